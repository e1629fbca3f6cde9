// How the site's search ranks what it finds: a page or section whose title has the word comes before those that mention it.
var Scorer = { objNameMatch: 11, objPartialMatch: 6, objPrio: { 0: 15, 1: 5, 2: -5 }, objPrioDefault: 0, title: 40, partialTitle: 20, term: 5, partialTerm: 2 };
