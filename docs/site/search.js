// The site's search. It ranks by the words of the query in titles of pages, then of sections, then by how many sentences hold all of
// them; the glossary above other mentions, decisions and changes below them. sentences.js has every page's: place, section, text.
const GREEK = "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi omicron pi rho sigma sigma tau upsilon phi chi psi omega".split(" ");
const spelled = (text) => text.normalize("NFKC").toLowerCase().replace(/[α-ω]/g, (letter) => GREEK[letter.charCodeAt(0) - 0x3b1]);
var splitQuery = (query) => spelled(query).split(/[^\p{L}\p{N}_]+/u).filter((word) => word); // a symbol as it is shown: Λ2, η_d
const asked = () => {
  const said = new URLSearchParams(location.search).get("q") || "";
  return spelled(said).split(/[^\p{L}\p{N}_-]+/u).filter((word) => word === "own" || (word && !stopwords.has(word)));
};
const LONGEST = 240; // of a sentence as it is shown
const stems = (words) => words.map((word) => new Stemmer().stemWord(word));
const share = (text, words) => words.filter((word) => ` ${text.toLowerCase()}`.includes(` ${word}`)).length / (words.length || 1);
const best = (place, anchor) => {
  const [words, known] = [stems(asked()), sentences[place] || []];
  const here = known.filter(([section]) => !anchor || anchor === section);
  const scored = (here.length ? here : known).map(([, text]) => [share(text, words), text]);
  const most = Math.max(0, ...scored.map(([part]) => part));
  return { whole: scored.filter(([part]) => part === 1).length, text: most ? scored.find(([part]) => part === most)[1] : "" };
};
var Scorer = {
  objNameMatch: 11, objPartialMatch: 6, objPrio: { 0: 15, 1: 5, 2: -5 }, objPrioDefault: 0, title: 15, partialTitle: 7, term: 5, partialTerm: 2,
  score: ([place, title, , , found]) => {
    const { docnames, alltitles } = Search._index, page = docnames.indexOf(place), words = asked();
    const headings = Object.keys(alltitles).filter((one) => alltitles[one].some(([file]) => file === page));
    const rank = place === "glossary" ? 20 : /^(decisions\/|changes|architecture|reference\/files)/.test(place) ? -15 : 0;
    const held = 3 * Math.min(5, best(place).whole);
    return found + rank + 30 * share(title, words) + 20 * Math.max(0, ...headings.map((one) => share(one, words))) ** 2 + held;
  },
};
// At once, for the search begins with the first listener of the loaded document.
Documentation.TRANSLATIONS["Your search did not match any documents. Please make sure that all words are spelled correctly and that you've selected enough categories."] =
  "No page has all of these words. Try fewer, or check their spelling.";
"add can change does get have how i make me my our should use want what when where which why you your".split(" ").forEach((word) => stopwords.add(word));
// Below each result stands the sentence that holds most of the words; Sphinx would fetch the page and cut its text.
new MutationObserver((changes) => changes.flatMap((one) => [...one.addedNodes]).forEach((item) => {
  const link = item.tagName === "LI" && item.querySelector("a");
  if (!link) return;
  const [place, anchor] = link.getAttribute("href").split("#"), { text } = best(place.replace(/\.html$/, ""), anchor);
  const first = Math.max(0, ...stems(asked()).map((word) => text.toLowerCase().search(`\\b${word}`)));
  const from = text.length > LONGEST && first > LONGEST / 2 ? text.indexOf(" ", first - LONGEST / 2) : 0;
  const said = Object.assign(document.createElement("p"), { className: "context" });
  said.textContent = `${from ? "… " : ""}${text.slice(from, from + LONGEST)}${from + LONGEST < text.length ? " …" : ""}`;
  item.append(said);
  asked().forEach((word) => SPHINX_HIGHLIGHT_ENABLED && _highlightText(said, word, "highlighted"));
})).observe(document.getElementById("search-results"), { childList: true, subtree: true });
