// SPDX-License-Identifier: Apache-2.0
// An order of things in which like ones stand together.

/**
 * The leaves of average-linkage clustering, from left to right: at each step the two groups join that are most alike in
 * the mean, of equals the first. `scores` is symmetric; of up to some hundred things.
 */
export function groupedOrder(scores: Float64Array[]): number[] {
  const groups: number[][] = scores.map((_, i) => [i]);
  const alike = scores.map((row) => Float64Array.from(row));
  const alive = scores.map((_, i) => i);  // groups that have not joined another, ascending
  /** Of each group the one after it that is most like it; -1: there is none. */
  const best = new Int32Array(scores.length);
  const look = (i: number) => {
    best[i] = -1;
    for (const j of alive) if (j > i && (best[i]! < 0 || alike[i]![j]! > alike[i]![best[i]!]!)) best[i] = j;
  };
  alive.forEach(look);
  while (alive.length > 1) {
    let a = -1;
    for (const i of alive) if (best[i]! >= 0 && (a < 0 || alike[i]![best[i]!]! > alike[a]![best[a]!]!)) a = i;
    const b = best[a]!;
    const [sizeA, sizeB] = [groups[a]!.length, groups[b]!.length];
    groups[a] = [...groups[a]!, ...groups[b]!];
    alive.splice(alive.indexOf(b), 1);
    for (const k of alive) {
      if (k !== a) alike[a]![k] = alike[k]![a] = (sizeA * alike[a]![k]! + sizeB * alike[b]![k]!) / (sizeA + sizeB);
    }
    for (const k of alive) {
      if (k === a || best[k] === a || best[k] === b) look(k);
      else if (k < a && (alike[k]![a]! > alike[k]![best[k]!]! || (alike[k]![a] === alike[k]![best[k]!] && a < best[k]!))) best[k] = a;
    }
  }
  return groups[alive[0] ?? -1] ?? [];
}
