// SPDX-License-Identifier: Apache-2.0
// Filters (docs/filters.md) as lists of terms, so that a facet can change one of them.

/** The conditions of a filter, without the blanks around them. Never fails: the server says what is wrong with a filter. */
export function termsOf(filter: string): string[] {
  return splitAt(filter, ',');
}

/** What stands between `separator`s that are not in quotes. */
function splitAt(filter: string, separator: string): string[] {
  const terms: string[] = [];
  let term = '';
  let quoted = false;
  for (let i = 0; i < filter.length; ++i) {
    const c = filter[i]!;
    if (quoted && c === '\\') {
      term += c + (filter[++i] ?? '');
      continue;
    }
    if (c === '"') quoted = !quoted;
    if (c === separator && !quoted) {
      terms.push(term.trim());
      term = '';
    } else {
      term += c;
    }
  }
  terms.push(term.trim());
  return terms.filter((one) => one !== '');
}

/** `key=value`, with quotes where the grammar wants them. */
export function equalTerm(key: string, value: string): string {
  const plain = value !== '' && value.trim() === value && !/[,|=!<>"\\]/.test(value);
  return `${key}=${plain ? value : `"${value.replace(/[\\"]/g, '\\$&')}"`}`;
}

export function missingTerm(key: string): string {
  return `!${key}`;
}

/**
 * The filter with this term, in place of another value of the same key; without it if it had it. Conditions with
 * alternatives (`a=1 | b=2`) stay.
 */
export function toggled(filter: string, key: string, term: string): string {
  const terms = termsOf(filter);
  const others = terms.filter((one) => one !== term && (!one.startsWith(`${key}=`) || splitAt(one, '|').length > 1) && one !== missingTerm(key));
  return (terms.includes(term) ? others : [...others, term]).join(', ');
}
