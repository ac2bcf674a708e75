#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes docs/api-reference.md of proto/: every call, message, field and value with its comment.

  scripts/api-reference.py            fails if the page is not what proto/ says
  scripts/api-reference.py --update   writes it

Needs protoc (PROTOC) and python3-protobuf.
"""

import os
import re
import subprocess
import sys
import tempfile

from google.protobuf import descriptor_pb2

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PAGE = os.path.join(ROOT, "docs", "api-reference.md")
ORDER = ["shape", "search", "align", "collection", "admin"]
FIELD = descriptor_pb2.FieldDescriptorProto
SCALARS = {number: name[len("TYPE_"):].lower() for name, number in FIELD.Type.items()}
# Numbers of the fields of descriptor.proto, of which the paths of comments consist.
FILE_MESSAGE, FILE_ENUM, FILE_SERVICE, MESSAGE_FIELD, MESSAGE_NESTED, MESSAGE_ENUM, ENUM_VALUE, SERVICE_METHOD = 4, 5, 6, 2, 3, 4, 2, 2
PACKAGE = ".shapedb.v1."

HEAD = """# API reference

Every call, message, field and value of the package `shapedb.v1`, with the comments of the
[`.proto` files](../proto/shapedb/v1), from which `scripts/api-reference.py --update` makes this page. [The API](api.md) says how
the calls belong together and lists the errors; [HTTP](http.md) and [other languages](other-languages.md) say how to make them.

*stream* stands where several messages are sent. A field marked *optional* tells "not set" from its default; one marked
*one of* excludes the others of that name. In JSON names are written `pointCount` or `point_count`.
"""


def descriptors():
    folder = os.path.join(ROOT, "proto")
    names = sorted(os.listdir(os.path.join(folder, "shapedb", "v1")))
    with tempfile.NamedTemporaryFile(suffix=".pb") as file:
        subprocess.run([os.environ.get("PROTOC", "protoc"), "-I" + folder, "--include_source_info",
                        "--descriptor_set_out=" + file.name] +
                       ["shapedb/v1/" + name for name in names if name.endswith(".proto")], check=True)
        files = descriptor_pb2.FileDescriptorSet.FromString(file.read())
    return {re.sub(r"_service$", "", os.path.basename(each.name)[:-len(".proto")]): each for each in files.file}


class Comments:
    def __init__(self, file):
        self.places = {tuple(place.path): place for place in file.source_code_info.location}

    def of(self, path):
        """Paragraphs before a declaration, or behind it on its line."""
        place = self.places.get(tuple(path))
        if place is None:
            return []
        text = place.leading_comments or place.trailing_comments
        paragraphs = re.split(r"\n\s*\n", "\n".join(line.strip() for line in text.split("\n")).strip())
        return [linked(" ".join(paragraph.split())) for paragraph in paragraphs if paragraph]

    def syntax(self):
        """What stands at the top of the file."""
        place = self.places.get((12,))
        text = (place.leading_detached_comments[0] if place.leading_detached_comments else place.leading_comments) if place else ""
        text = re.sub(r"^ *SPDX-License-Identifier:.*\n", "", text)
        return [linked(" ".join(paragraph.split())) for paragraph in re.split(r"\n\s*\n", text.strip()) if paragraph.strip()]


def linked(text):
    text = re.sub(r"(?<![`\w])<", "&lt;", text)
    return re.sub(r"\bdocs/([\w-]+)\.md\b", r"[\1.md](\1.md)", text)


def cell(paragraphs):
    return "<br>".join(paragraphs).replace("|", "\\|")


def reference(name):
    short = name[len(PACKAGE):] if name.startswith(PACKAGE) else name.lstrip(".")
    return f"[`{short}`](#{short.replace('.', '').lower()})" if name.startswith(PACKAGE) else f"`{short}`"


def type_of(field, message):
    for nested in message.nested_type:
        if nested.options.map_entry and field.type_name.endswith("." + nested.name):
            key, value = nested.field
            return f"map of `{SCALARS[key.type]}` to {type_of(value, nested)}"
    kind = reference(field.type_name) if field.type_name else f"`{SCALARS[field.type]}`"
    if field.label == FIELD.LABEL_REPEATED:
        return "list of " + kind
    if field.proto3_optional:
        return kind + ", optional"
    if field.HasField("oneof_index"):
        return f"{kind}, one of *{message.oneof_decl[field.oneof_index].name}*"
    return kind


def enum(lines, comments, path, each, prefix):
    lines += ["", f"### {prefix}{each.name}", ""] + separated(comments.of(path))
    lines += ["| value | number | |", "|---|---:|---|"]
    for number, value in enumerate(each.value):
        lines.append(f"| `{value.name}` | {value.number} | {cell(comments.of(path + [ENUM_VALUE, number]))} |")


def separated(paragraphs):
    return [line for paragraph in paragraphs for line in (paragraph, "")]


def message(lines, comments, path, each, prefix=""):
    lines += ["", f"### {prefix}{each.name}", ""] + separated(comments.of(path))
    if each.field:
        lines += ["| field | type | |", "|---|---|---|"]
    else:
        lines.append("No fields.")
    for number, field in enumerate(each.field):
        lines.append(f"| `{field.name}` | {type_of(field, each)} | {cell(comments.of(path + [MESSAGE_FIELD, number]))} |")
    for number, nested in enumerate(each.nested_type):
        if not nested.options.map_entry:
            message(lines, comments, path + [MESSAGE_NESTED, number], nested, f"{prefix}{each.name}.")
    for number, nested in enumerate(each.enum_type):
        enum(lines, comments, path + [MESSAGE_ENUM, number], nested, f"{prefix}{each.name}.")


def types(lines, file):
    comments = Comments(file)
    for number, each in enumerate(file.message_type):
        message(lines, comments, [FILE_MESSAGE, number], each)
    for number, each in enumerate(file.enum_type):
        enum(lines, comments, [FILE_ENUM, number], each, "")


def service(lines, file):
    comments = Comments(file)
    for number, each in enumerate(file.service):
        lines += ["", f"## {each.name}", ""] + separated(comments.syntax())
        lines += ["| call | takes | answers |", "|---|---|---|"]
        for method in each.method:
            takes = ("stream of " if method.client_streaming else "") + reference(method.input_type)
            answers = ("stream of " if method.server_streaming else "") + reference(method.output_type)
            lines.append(f"| [`{method.name}`](#{each.name.lower()}{method.name.lower()}) | {takes} | {answers} |")
        for place, method in enumerate(each.method):
            lines += ["", f"### {each.name}.{method.name}", ""]
            lines += separated(comments.of([FILE_SERVICE, number, SERVICE_METHOD, place]))
            lines += [f"Over HTTP: `POST /shapedb.v1.{each.name}/{method.name}`"]


def page():
    files = descriptors()
    assert set(files) == set(ORDER) | {"types"}, "a new .proto file: name it in ORDER"
    lines = [HEAD.rstrip()]
    for name in ORDER:
        service(lines, files[name])
        types(lines, files[name])
    lines += ["", "## Shared messages", ""] + separated(Comments(files["types"]).syntax())
    types(lines, files["types"])
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines)) + "\n"


def main():
    text = page()
    if "--update" in sys.argv[1:]:
        with open(PAGE, "w", encoding="utf-8") as file:
            file.write(text)
        return 0
    try:
        with open(PAGE, encoding="utf-8") as file:
            same = file.read() == text
    except FileNotFoundError:
        same = False
    if not same:
        print("docs/api-reference.md is not what proto/ says: scripts/api-reference.py --update writes it", file=sys.stderr)
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
