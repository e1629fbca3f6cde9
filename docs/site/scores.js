// How the site's search ranks what it finds: by the words of the query in titles of pages, then of sections; the glossary above other
// mentions, decisions and changes below them.
var Scorer = {
  objNameMatch: 11, objPartialMatch: 6, objPrio: { 0: 15, 1: 5, 2: -5 }, objPrioDefault: 0, title: 15, partialTitle: 7, term: 5, partialTerm: 2,
  score: ([place, title, , , found]) => {
    const { docnames, alltitles } = Search._index, page = docnames.indexOf(place);
    const asked = new URLSearchParams(location.search).get("q") || "";
    const words = asked.toLowerCase().split(/[^\p{L}\p{N}_-]+/u).filter((word) => word === "own" || (word && !stopwords.has(word)));
    const share = (text) => words.filter((word) => ` ${text.toLowerCase()}`.includes(` ${word}`)).length / (words.length || 1);
    const headings = Object.keys(alltitles).filter((one) => alltitles[one].some(([file]) => file === page));
    const rank = place === "glossary" ? 20 : /^(decisions\/|changes|architecture|reference\/files)/.test(place) ? -15 : 0;
    return found + rank + 30 * share(title) + 20 * Math.max(0, ...headings.map(share)) ** 2;
  },
};
addEventListener("DOMContentLoaded", () =>
  "add can change does get have how i make me my our should use want what when where which why you your".split(" ").forEach((word) => stopwords.add(word)));
