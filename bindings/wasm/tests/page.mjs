// Does the page bake what is dropped on it, and show the contacts of a second mesh? Headless Chromium, driven by its DevTools.
// node page.mjs URL BODY MESH SDFTOOL [PICTURE.png]: URL is that of index.html on a web server; SDFTOOL says what must be found.
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { basename, join, resolve } from "node:path";

const [url, body, mesh, program, picture] = process.argv.slice(2);
const work = mkdtempSync(join(tmpdir(), "sdftool-page-"));
const browser = spawn("chromium", ["--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync", `--user-data-dir=${join(work, "profile")}`, "--use-angle=swiftshader",
  "--enable-unsafe-swiftshader", "--window-size=1000,700", "--remote-debugging-pipe", "about:blank"], { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"], detached: true });
const limit = setTimeout(() => fail("not done after 180 s"), 180e3);
const fail = text => { console.error(`page: ${text}`); process.exit(1); };
process.on("exit", () => {
  // With its children, which would write into their profile a little longer.
  try { process.kill(-browser.pid, "SIGKILL"); } catch { /* It is gone. */ }
  try { rmSync(work, { recursive: true, force: true, maxRetries: 5 }); } catch (error) { console.log(`page: ${error.code} in ${work}`); }
});

// A message is JSON ended by a zero, on either pipe.
const answers = new Map();
let count = 0, rest = "", session;
browser.stdio[4].on("data", data => {
  const messages = (rest + data).split("\0");
  rest = messages.pop();
  for (const { id, result, error } of messages.map(text => JSON.parse(text))) {
    if (id) (error ? fail(error.message) : answers.get(id)(result));
  }
});
const ask = (method, params = {}) => new Promise(answered => {
  answers.set(++count, answered);
  browser.stdio[3].write(JSON.stringify({ id: count, method, params, sessionId: session }) + "\0");
});
const evaluate = async expression => {
  const { result, exceptionDetails } = await ask("Runtime.evaluate", { expression, awaitPromise: true, returnByValue: true });
  if (exceptionDetails) fail(exceptionDetails.exception?.description ?? exceptionDetails.text);
  return result.value;
};
const until = async expression => { while (!await evaluate(expression)) await new Promise(go => setTimeout(go, 100)); };
const idle = () => until(`document.getElementById("stop").hidden && !/^(baking|contacts of) /.test(document.getElementById("status").textContent)`);
const status = () => evaluate(`document.getElementById("status").textContent`);
const drop = async path => {
  await evaluate(`document.getElementById("status").textContent = ""`);
  const data = { items: [], files: [resolve(path)], dragOperationsMask: 1 };
  for (const type of ["dragEnter", "dragOver", "drop"]) await ask("Input.dispatchDragEvent", { type, x: 500, y: 400, data });
  await until(`document.getElementById("status").textContent != ""`);
  await idle();
};
const drawn = () => until(`document.getElementById("view").contentDocument?.documentElement?.dataset?.drawn?.startsWith("ready")`);
const sdftool = (...words) => JSON.parse(execFileSync(program, [...words, "--json"], { encoding: "utf8", maxBuffer: 2 ** 30 }));

const { targetInfos } = await ask("Target.getTargets");
session = (await ask("Target.attachToTarget", { targetId: targetInfos.find(target => target.type == "page").targetId, flatten: true })).sessionId;
await ask("Page.enable");
await ask("Page.navigate", { url });
await until(`document.readyState == "complete" && !!document.getElementById("hint")`);

// What is not a mesh is refused in words, and the page lives on.
const wrong = join(work, "wrong.obj");
writeFileSync(wrong, "hello\n");
await drop(wrong);
assert.match(await status(), /wrong\.obj/);
assert.equal(await evaluate(`document.getElementById("status").className`), "failed");

await evaluate(`Object.assign(document.getElementById("res"), { value: "64" }), Object.assign(document.getElementById("margin"), { value: "0.02" })`);
await drop(body);
const baked = sdftool("bake", body, "--res", "64", "--layout", "sparse", "-o", join(work, "body.sdf.h5"));
assert.match(await status(), new RegExp(`^sparse ${baked.counts.join(" × ")}, error at most ${Number(baked.error_bound.toPrecision(4))},`));
await drawn();

// Dropped on the picture, which is a frame of its own.
await drop(mesh);
const found = sdftool("contacts", mesh, join(work, "body.sdf.h5"), "--margin", "0.02").contacts;
const inside = found.filter(contact => contact.distance < 0), deepest = Math.min(...found.map(contact => contact.distance));
assert(found.length > 0);
const said = await status();
assert(said.startsWith(`${found.length} contacts of `), said);
assert(said.includes(`${inside.length} inside, deepest ${Number(deepest.toPrecision(4))},`), said);
await drawn();
const rows = await evaluate(`[...document.getElementById("view").contentDocument.querySelectorAll("#facts tr")].map(row => [...row.cells].map(cell => cell.textContent))`);
const facts = Object.fromEntries(rows);
assert.equal(facts.contacts, String(found.length));
assert.equal(await evaluate(`document.getElementById("view").contentDocument.documentElement.dataset.drawn`), "ready 0");
assert.equal(await evaluate(`document.getElementById("view").contentDocument.getElementById("name").textContent`), `${basename(mesh).split(".")[0]} on ${basename(body).split(".")[0]}`);
if (picture) writeFileSync(picture, Buffer.from((await ask("Page.captureScreenshot")).data, "base64"));
console.log(`page: ${said}; as by the program`);

// Other options, and a file that is picked again, are searched again.
const answered = async () => { await until(`document.getElementById("status").textContent != ""`); await idle(); return status(); };
const change = async (id, value) => {
  await evaluate(`document.getElementById("status").textContent = "", document.getElementById("${id}").value = "${value}", document.getElementById("${id}").dispatchEvent(new Event("change"))`);
  return answered();
};
const pick = async (id, path) => {
  await evaluate(`document.getElementById("status").textContent = "", document.getElementById("${id}").click()`);
  // Else the browser does not tell of the same file.
  assert.equal(await evaluate(`document.getElementById("${id}").value`), "");
  const { root } = await ask("DOM.getDocument");
  const { nodeId } = await ask("DOM.querySelector", { nodeId: root.nodeId, selector: `#${id}` });
  await ask("DOM.setFileInputFiles", { nodeId, files: [resolve(path)] });
  return answered();
};
const begins = elements => {
  const { contacts, elements: count } = sdftool("contacts", mesh, join(work, "body.sdf.h5"), "--margin", "0.03", "--elements", elements);
  return `${contacts.length} contacts of ${count} ${elements}, `;
};
for (const [id, value, elements] of [["margin", "0.03", "faces"], ["elements", "edges", "edges"]]) {
  const now = await change(id, value);
  assert(now.startsWith(begins(elements)), now);
}
for (let turn = 0; turn < 2; turn++) {
  const now = await pick("mesh", mesh);
  assert(now.startsWith(begins("edges")), now);
}
console.log("page: searched again");

// A field that is lost, by a body that fails or a bake that is stopped, is not saved.
const isKeptShown = () => evaluate(`!document.getElementById("keep").hidden`);
const keep = async () => {
  await evaluate(`document.getElementById("status").textContent = "", document.getElementById("keep").click()`);
  return answered();
};
assert(await isKeptShown());
assert.match(await pick("body", wrong), /wrong\.obj/);
assert(!await isKeptShown());
assert.match(await keep(), /^there is no body yet/);
await pick("body", body);
assert(await isKeptShown());
await evaluate(`document.getElementById("stop").click()`);
assert(!await isKeptShown());
assert.match(await keep(), /^there is no body yet/);
console.log("page: no lost field is saved");
clearTimeout(limit);
process.exit(0);
