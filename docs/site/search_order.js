// The order of what the search finds. Sphinx's own points say little about long pages, since it does not count how often a word is in
// one: so pages that say what to do come before others, and decisions last. The other figures are Sphinx's own.
var Scorer = {
  score([page, , , , points]) {
    if (/^docs\/(tutorial|class|operations|site|visitors|access|machine|monitoring|gateway|proxies|docker|clusters|embedding|migration|upgrade|backup)$/.test(page))
      return points + 2;
    return page.startsWith('docs/decisions/') ? points - 1 : points;
  },
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
