// SPDX-License-Identifier: Apache-2.0
// An order of things in which like ones stand together.

/**
 * The leaves of average-linkage clustering, from left to right: at each step the two groups join that are most alike in
 * the mean. `scores` is symmetric; of up to some hundred things.
 */
export function groupedOrder(scores: Float64Array[]): number[] {
  const groups = scores.map((_, i) => [i]);
  const alike = scores.map((row) => Float64Array.from(row));
  while (groups.length > 1) {
    let [a, b] = [0, 1];
    for (let i = 0; i < groups.length; ++i) {
      for (let j = i + 1; j < groups.length; ++j) if (alike[i]![j]! > alike[a]![b]!) [a, b] = [i, j];
    }
    const [sizeA, sizeB] = [groups[a]!.length, groups[b]!.length];
    for (let k = 0; k < groups.length; ++k) {
      const mean = (sizeA * alike[a]![k]! + sizeB * alike[b]![k]!) / (sizeA + sizeB);
      alike[a]![k] = alike[k]![a] = mean;
    }
    groups[a] = [...groups[a]!, ...groups[b]!];
    groups.splice(b, 1);
    alike.splice(b, 1);
    alike.forEach((row, k) => (alike[k] = row.filter((_, column) => column !== b)));
  }
  return groups[0] ?? [];
}
