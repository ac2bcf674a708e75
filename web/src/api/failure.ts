// SPDX-License-Identifier: Apache-2.0
// Why a call failed, in words for the person at the screen.

export class Failure extends Error {
  constructor(
    /** Of the Connect protocol: "not_found", "unauthenticated"; "unreachable" if there was no answer. */
    readonly code: string,
    message: string,
  ) {
    super(message);
  }
}

/** The body of a failed call, or of the end of a stream: {"code": ..., "message": ...}. */
export function failureFrom(json: unknown, status: number): Failure {
  const { code, message } = (json ?? {}) as { code?: unknown; message?: unknown };
  return new Failure(
    typeof code === 'string' ? code : `http_${status}`,
    typeof message === 'string' && message !== '' ? message : `the server answered with status ${status}`,
  );
}

export function unreachable(): Failure {
  return new Failure('unreachable', 'the server cannot be reached: it may have been stopped, or the network is down');
}

export function isCancelled(error: unknown): boolean {
  return error instanceof DOMException && error.name === 'AbortError';
}

/** What to show of any error. */
export function messageOf(error: unknown): string {
  if (error instanceof Failure) return error.message;
  return error instanceof Error ? error.message : String(error);
}
