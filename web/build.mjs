// SPDX-License-Identifier: Apache-2.0
// node build.mjs [FOLDER [PROTOC]]: writes the page's files to FOLDER (dist/), ready to be served. Needs no network.
//
// protoc writes gen/: the messages and services of ../proto as TypeScript, so that the page cannot drift from the API.
import { execFileSync } from 'node:child_process';
import { cpSync, mkdirSync, mkdtempSync, readdirSync, renameSync, rmSync, writeFileSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';

const web = dirname(fileURLToPath(import.meta.url));
const proto = join(web, '..', 'proto');
const out = resolve(process.argv[2] ?? join(web, 'dist'));
const run = (program, ...args) => execFileSync(program, args, { cwd: web, stdio: 'inherit' });

// Two builds at once write the same files: each is put in its place whole.
const files = readdirSync(join(proto, 'shapedb/v1')).filter((name) => name.endsWith('.proto'));
mkdirSync(join(web, 'gen/shapedb/v1'), { recursive: true });
const fresh = mkdtempSync(join(web, 'gen/new-'));
run(process.argv[3] ?? 'protoc', `--plugin=protoc-gen-es=${join(web, 'node_modules/.bin/protoc-gen-es')}`,
  `--es_out=${fresh}`, '--es_opt=target=ts', `--proto_path=${proto}`, ...files.map((name) => `shapedb/v1/${name}`));
for (const name of readdirSync(join(fresh, 'shapedb/v1'))) {
  renameSync(join(fresh, 'shapedb/v1', name), join(web, 'gen/shapedb/v1', name));
}
rmSync(fresh, { recursive: true });
run(join(web, 'node_modules/.bin/tsc'), '--noEmit');

rmSync(out, { recursive: true, force: true });
const { metafile } = await build({
  entryPoints: [join(web, 'src/main.ts'), join(web, 'src/worker.ts'), join(web, 'style.css')],
  outdir: out,
  bundle: true,
  splitting: true,
  format: 'esm',
  target: 'es2022',
  minify: true,
  legalComments: 'none',
  chunkNames: 'part-[hash]',
  entryNames: '[name]',
  logLevel: 'warning',
  metafile: true,
});
for (const name of ['index.html', 'icon.svg', 'licences.txt']) cpSync(join(web, name), join(out, name));

// Beside the folder, which is served whole: the npm packages that are in it.
const bundled = Object.values(metafile.outputs).flatMap((output) => Object.keys(output.inputs))
  .map((path) => /(?:^|\/)node_modules\/((?:@[^/]+\/)?[^/]+)\//.exec(path)?.[1]).filter(Boolean);
writeFileSync(`${out}.packages.txt`, [...new Set(bundled)].sort().map((name) => `${name}\n`).join(''));
