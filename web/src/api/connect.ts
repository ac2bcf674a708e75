// SPDX-License-Identifier: Apache-2.0
// Calls of the server by the Connect protocol, with protobuf. connect-web would do the same, but cannot send streams.
import { create, fromBinary, toBinary } from '@bufbuild/protobuf';
import type { DescMessage, MessageInitShape, MessageShape } from '@bufbuild/protobuf';
import type { DescMethod } from '@bufbuild/protobuf';

import { EnvelopeReader, inEnvelope } from './envelope';
import { failureFrom, unreachable } from './failure';
import { apiKey } from './session';

/** A method of a service, as protoc-gen-es writes it. */
type Method<I extends DescMessage, O extends DescMessage> = DescMethod & { input: I; output: O };

export interface CallOptions {
  signal?: AbortSignal | undefined;
  /** How much of the request has been sent, 0 to 1. */
  onSent?: (share: number) => void;
}

function pathOf(method: DescMethod): string {
  return `/${method.parent.typeName}/${method.name}`;
}

function headersOf(contentType: string): Record<string, string> {
  const headers: Record<string, string> = { 'Content-Type': contentType, 'Connect-Protocol-Version': '1' };
  if (apiKey() !== '') headers['Authorization'] = `Bearer ${apiKey()}`;
  return headers;
}

function parsed(text: string): unknown {
  try {
    return JSON.parse(text);
  } catch {
    return undefined;
  }
}

async function post(method: DescMethod, contentType: string, body: Blob, options: CallOptions): Promise<Response> {
  let response: Response;
  try {
    response = await fetch(pathOf(method), {
      method: 'POST',
      headers: headersOf(contentType),
      body,
      signal: options.signal ?? null,
    });
  } catch (error) {
    options.signal?.throwIfAborted();
    throw error instanceof TypeError ? unreachable() : error;
  }
  if (!response.ok) throw failureFrom(parsed(await response.text()), response.status);
  return response;
}

/** One message, one answer. Throws a Failure, or an AbortError. */
export async function call<I extends DescMessage, O extends DescMessage>(
  method: Method<I, O>,
  request: MessageInitShape<I>,
  options: CallOptions = {},
): Promise<MessageShape<O>> {
  const bytes = toBinary(method.input, create(method.input, request));
  const response = await post(method, 'application/proto', new Blob([bytes as BlobPart]), options);
  return fromBinary(method.output, new Uint8Array(await response.arrayBuffer()));
}

/** One message, many answers, each told as it arrives. */
export async function follow<I extends DescMessage, O extends DescMessage>(
  method: Method<I, O>,
  request: MessageInitShape<I>,
  onAnswer: (answer: MessageShape<O>) => void,
  options: CallOptions = {},
): Promise<void> {
  const bytes = toBinary(method.input, create(method.input, request));
  const body = new Blob(inEnvelope(bytes) as BlobPart[]);
  const response = await post(method, 'application/connect+proto', body, options);
  const envelopes = new EnvelopeReader();
  const reader = response.body!.getReader();
  let ended = false;
  // To the very end: a body that is not read until then counts as cancelled, and its connection is closed.
  for (;;) {
    const { done, value } = await reader.read();
    if (done) break;
    ended = takeAnswers(method.output, envelopes, value, onAnswer) || ended;
  }
  if (!ended) throw unreachable();
}

/** Many messages, and all that is answered at the end; `onAnswer` is told each as it arrives. */
export async function send<I extends DescMessage, O extends DescMessage>(
  method: Method<I, O>,
  requests: Iterable<MessageInitShape<I>>,
  options: CallOptions & { onAnswer?: (answer: MessageShape<O>) => void } = {},
): Promise<MessageShape<O>[]> {
  const parts: BlobPart[] = [];
  for (const request of requests) {
    parts.push(...(inEnvelope(toBinary(method.input, create(method.input, request))) as BlobPart[]));
  }
  const answers: MessageShape<O>[] = [];
  const envelopes = new EnvelopeReader();
  let ended = false;
  await upload(method, new Blob(parts), options, (bytes) => {
    ended = takeAnswers(method.output, envelopes, bytes, (answer) => {
      answers.push(answer);
      options.onAnswer?.(answer);
    });
  });
  if (!ended) throw unreachable();
  return answers;
}

/** True: that was the end of the stream. */
function takeAnswers<O extends DescMessage>(
  output: O,
  envelopes: EnvelopeReader,
  bytes: Uint8Array,
  onAnswer: (answer: MessageShape<O>) => void,
): boolean {
  for (const { message, last } of envelopes.add(bytes)) {
    if (last) {
      const end = parsed(new TextDecoder().decode(message)) as { error?: unknown } | undefined;
      if (end?.error !== undefined) throw failureFrom(end.error, 200);
      return true;
    }
    onAnswer(fromBinary(output, message));
  }
  return false;
}

/** One byte for each letter of x-user-defined, in which XMLHttpRequest hands out what has arrived so far. */
function bytesOf(text: string): Uint8Array {
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}

/** XMLHttpRequest, for fetch does not tell how much has been sent. `onBytes` gets the answer piece by piece. */
function upload(method: DescMethod, body: Blob, options: CallOptions, onBytes: (bytes: Uint8Array) => void): Promise<void> {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open('POST', pathOf(method));
    for (const [name, value] of Object.entries(headersOf('application/connect+proto'))) {
      request.setRequestHeader(name, value);
    }
    request.overrideMimeType('text/plain; charset=x-user-defined');
    let taken = 0;
    const take = () => {
      if (request.status !== 200) return;
      const text = request.responseText;
      try {
        if (text.length > taken) onBytes(bytesOf(text.slice(taken)));
      } catch (error) {
        reject(error as Error);
      }
      taken = text.length;
    };
    request.upload.onprogress = (event) => options.onSent?.(event.total > 0 ? event.loaded / event.total : 1);
    request.onprogress = take;
    request.onload = () => {
      take();
      if (request.status === 200) return resolve();
      reject(failureFrom(parsed(new TextDecoder().decode(bytesOf(request.responseText))), request.status));
    };
    request.onerror = () => reject(unreachable());
    request.onabort = () => reject(new DOMException('cancelled', 'AbortError'));
    options.signal?.addEventListener('abort', () => request.abort());
    if (options.signal?.aborted) return reject(new DOMException('cancelled', 'AbortError'));
    request.send(body);
  });
}
