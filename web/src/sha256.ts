// SPDX-License-Identifier: Apache-2.0
/** SHA-256 of the points as they are sent; empty where the browser has none (pages without TLS from other machines). */
export async function sha256(positions: Float32Array): Promise<Uint8Array<ArrayBuffer>> {
  if (crypto.subtle === undefined) return new Uint8Array();
  return new Uint8Array(await crypto.subtle.digest('SHA-256', positions as Float32Array<ArrayBuffer>));
}
