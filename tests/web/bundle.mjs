// SPDX-License-Identifier: Apache-2.0
// Parts of the page's source as one module, for tests without a browser.
import { mkdtempSync, rmSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';

const web = fileURLToPath(new URL('../../web', import.meta.url));
const { build } = createRequire(join(web, 'package.json'))('esbuild');

/** What `parts` of web/src export, and how to remove the module again. */
export async function bundled(parts) {
  const folder = mkdtempSync(join(web, 'node_modules/.units-'));  // where imports of the bundle are found
  await build({
    stdin: { contents: parts.map((part) => `export * from './${part}';`).join('\n'), resolveDir: join(web, 'src'), loader: 'ts' },
    bundle: true, format: 'esm', platform: 'node', outfile: join(folder, 'page.mjs'), logLevel: 'error',
  });
  const page = await import(pathToFileURL(join(folder, 'page.mjs')));
  return { page, remove: () => rmSync(folder, { recursive: true, force: true }) };
}
