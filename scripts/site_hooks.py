# SPDX-License-Identifier: GPL-3.0-or-later
"""What mkdocs needs to show our pages as they are shown elsewhere (mkdocs.yml)."""

import re

MARKER = re.compile(r"^[ \t]*<!-- (setup|not run|output|data)\b.*-->[ \t]*\n", re.MULTILINE)
LINK_TEXT = r"(?<!!)\[((?:[^\[\]]|\[[^\]]*\])*)\]"
LINK = re.compile(LINK_TEXT + r"\((\.\./[^)\s]+)\)")
ITEM = re.compile(r"([-*]|\d+\.) +")


def slug(text, separator):
    """The anchor of a heading, as on GitHub."""
    text = re.sub(r"<[^>]*>", "", text).strip().lower()
    return re.sub(r"[^\w\- ]", "", text).replace(" ", separator)


def lists(text):
    """Lists indented as Python's Markdown wants them: by four blanks, after a blank line."""
    lines = []
    stack = []  # columns where the contents of the open items begin
    fenced = False
    for line in text.split("\n"):
        bare = line.lstrip()
        indent = len(line) - len(bare)
        if not bare:
            lines.append("")
            continue
        if not fenced:
            while stack and indent < stack[-1]:
                stack.pop()
        depth = len(stack)
        rest = indent - (stack[-1] if stack else 0)
        item = None if fenced or rest > 3 else ITEM.match(bare)
        if item:
            if depth == 0 and lines and lines[-1] and not ITEM.match(lines[-1].lstrip()) and not lines[-1].startswith(" "):
                lines.append("")
            stack.append(indent + len(item.group(0)))
            lines.append(" " * (4 * depth) + bare)
        else:
            lines.append(" " * (4 * depth + max(rest, 0)) + bare)
        if bare.startswith("```"):
            fenced = not fenced
    return "\n".join(lines)


def on_page_markdown(markdown, **_):
    markdown = MARKER.sub("", markdown)
    markdown = LINK.sub(lambda link: "[" + link.group(1) + "](api-reference.md)" if "/proto/" in link.group(2) else link.group(1),
                        markdown)  # sources are not part of the site
    return lists(markdown)
