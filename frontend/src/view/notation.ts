// Symbols as the field writes them, out of names as code writes them: `K_r1 > m Lambda1` has a subscript and a capital lambda.

import { timesPower } from "./format";

const GREEK: Readonly<Record<string, string>> = {
  psi: "ψ",
  theta: "θ",
  phi: "φ",
  tau: "τ",
  kappa: "κ",
  sigma: "σ",
  xi: "ξ",
  eta: "η",
  omega: "ω",
  Lambda: "Λ",
  Omega: "Ω",
  Gamma: "Γ",
  Sigma: "Σ",
};

const ACCENTS: Readonly<Record<string, string>> = { dot: "\u0307", ddot: "\u0308", hat: "\u0302", tilde: "\u0303" };

export interface Piece {
  readonly text: string;
  readonly low: boolean;
  /** The letter of a symbol, which legends and sliders show in the face of formulas. */
  readonly symbol?: boolean;
}

// a name with parts after underscores or a number at its end; psi, tau_psi, K_r1, Lambda2, x_d, norm_W1, W1
const SYMBOL = /(?<![\p{L}\p{N}_.])(\p{L}+)(\d?)((?:_[\p{L}\p{N}]+)*)(?![\p{L}\p{N}_]|\.[\p{L}\p{N}])/gu;

const LETTER = /^\p{L}/u;
const WORD = /^(\p{Ll}{2,}|a)(?![\p{L}\p{N}_])/u;
const UNIT = /^(u?m|s|N)$/;
const UNIT_APART = /(?<=\d) (?=([µmk]?m|s|N|kg|rad|%)(?![\p{L}\p{N}]))/gu; // a line must not end there
const PARAMETER = /^\p{Lu}{2,}_/u; // of an autopilot: MC_ROLLRATE_P is written so

/** Text in pieces, subscripts by themselves. */
export function pieces(text: string): Piece[] {
  const found: Piece[] = [];
  let done = 0;
  const alone = !/\p{L}{2}/u.test(text.replace(SYMBOL, (whole, name: string, digit: string, tail: string) => (digit || tail || Object.hasOwn(GREEK, name) ? "" : whole)));
  for (const match of text.matchAll(SYMBOL)) {
    const [whole, name, digit, tail] = match as unknown as [string, string, string, string];
    const greek = Object.hasOwn(GREEK, name) ? GREEK[name]! : undefined;
    // In a line without words a letter is a symbol; after a number it is a unit.
    const letter = alone && whole.length === 1 && !/\d $/.test(text.slice(0, match.index));
    const isSymbol = greek !== undefined || letter || ((name.length <= 2 || /^_[dxyz]$/.test(tail)) && (digit !== "" || tail !== "") && !UNIT.test(name) && !PARAMETER.test(whole));
    if (!isSymbol) continue;
    const parts = [digit, ...tail.split("_")].filter(Boolean);
    const accents = parts.map((part) => (Object.hasOwn(ACCENTS, part) ? ACCENTS[part]! : "")).join("");
    const low = parts.filter((part) => !Object.hasOwn(ACCENTS, part)).map((part) => (Object.hasOwn(GREEK, part) ? GREEK[part]! : part));
    found.push({ text: text.slice(done, match.index), low: false }, { text: (greek ?? name) + accents, low: false, symbol: !accents && (greek ?? name).length === 1 });
    if (low.length) found.push({ text: low.join(" "), low: true });
    done = match.index + whole.length;
  }
  found.push({ text: text.slice(done), low: false });
  return found.filter((piece) => piece.text).map((piece) => ({ ...piece, text: prose(piece.text).replace(UNIT_APART, "\u00a0") }));
}

/** Text with signs set properly: a minus between spaces, micro, squares. */
export function prose(text: string): string {
  return text
    .replace(/(?<=\d )um\b/g, "µm")
    .replace(/ - /g, " − ")
    .replace(/\^2/g, "²")
    .replace(/\^3/g, "³")
    .replace(/(?<=\d)e\+00\b/g, "")
    .replace(/(?<![\w.])(\d+(?:\.\d+)?)e([+-]\d+)\b/g, (_, factor: string, e: string) => timesPower(factor, Number(e)))
    .replace(/'/g, "’");
}

/** The same as nodes: subscripts set low, letters of symbols in elements of their own. */
export function rich(text: string): Node[] {
  return pieces(text).map((piece) => {
    if (!piece.low && !piece.symbol) return document.createTextNode(piece.text);
    const set = document.createElement(piece.low ? "sub" : "i");
    set.textContent = piece.text;
    if (/[Α-Ω]/.test(piece.text)) set.className = "upright"; // as formulas set capitals of Greek
    return set;
  });
}

/** The same where nothing can be set low: on a canvas, in a title. */
export function flat(text: string): string {
  return pieces(text)
    .map((piece, _, all) => (piece.low && LETTER.test(piece.text) && all.length > 1 ? `_${piece.text}` : piece.text))
    .join("");
}

/** The same for the ear, which hears no underscore: K r1. */
export function spoken(text: string): string {
  const said = Object.entries(ACCENTS).reduce((words, [name, accent]) => words.replaceAll(accent, ` ${name}`), flat(text));
  return said.replaceAll("_", " ");
}

/** The same, beginning with a capital where it begins with a word. */
export function sentence(text: string): Node[] {
  return rich(WORD.test(text) && !Object.hasOwn(GREEK, text.split(/\W/)[0] ?? "") ? text[0]!.toUpperCase() + text.slice(1) : text);
}

/** A sentence with the full stop that it may lack. */
export function closed(text: string): string {
  return /[.?!…]["”’)]?$/.test(text) ? text : `${text}.`;
}

/** A number of things: 1 signal, 2 signals. */
export function count(many: number, one: string, more = `${one}s`): string {
  return `${many} ${many === 1 ? one : more}`;
}
