// The document, and how text is made. No statistics here: every number was worked out by armcal and only finds its place.

const doc = JSON.parse(document.getElementById("data").textContent);
const $ = (id) => document.getElementById(id);

// An element with text; names from outside are only ever text.
function element(tag, text, className) {
  const made = document.createElement(tag);
  if (text !== undefined) made.textContent = text;
  if (className) made.className = className;
  return made;
}

function row(cells, tag = "td") {
  const made = document.createElement("tr");
  for (const cell of cells) {
    const own = cell instanceof Node ? cell : String(cell);
    const box = element(tag);
    box.append(own);
    breakable(box);
    if (typeof cell === "string" && /^[+−-]?[\d.]+(e-?\d+)?( ?%)?$/.test(cell)) box.className = "num";
    made.append(box);
  }
  return made;
}

// The charts read a little HTML: what could be taken for it is spelt out.
const plain = (text) => String(text).replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;");

// Places where a long name may break, so that no column is as wide as its longest name and none breaks within a word.
function breakable(box) {
  const texts = document.createTreeWalker(box, NodeFilter.SHOW_TEXT), all = [];
  while (texts.nextNode()) all.push(texts.currentNode);
  for (const text of all) {
    const parts = text.data.split(/(?<=[/+,])(?=[A-Za-z])/);
    if (parts.length > 1) text.replaceWith(...parts.flatMap((part, k) => k ? [document.createElement("wbr"), part] : [part]));
  }
}

// Millimetres as armcal writes them: two decimals, more where two would hide what matters.
function mm(value) {
  if (value === null || value === undefined) return "–";
  const size = Math.abs(value);
  const decimals = size >= 0.095 || size < 1e-9 ? 2 : size >= 0.0095 ? 3 : 4;
  return value.toFixed(decimals).replace("-", "−");
}
// Three digits that count.
const digits = (value) => value === null ? "–" : String(Number(value.toPrecision(3))).replace("-", "−");
// A change, to a thousandth; what rounds to nothing has no sign.
function signed(value) {
  const text = Math.abs(value).toFixed(3);
  return (Number(text) === 0 ? "" : value > 0 ? "+" : "−") + text;
}

// What a sentence has between backticks, as code.
function markCommands(box) {
  for (const node of [...box.childNodes].filter((n) => n.nodeType === Node.TEXT_NODE && n.data.includes("`"))) {
    const parts = node.data.split("`");
    node.replaceWith(...parts.map((text, k) => k % 2 === 1 && k < parts.length - 1 ? element("code", text) : document.createTextNode(text)));
  }
}
