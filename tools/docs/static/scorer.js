// SPDX-License-Identifier: Apache-2.0
// Order of the search's results: Sphinx's own weights, then guides and the glossary before the lab book.
var Scorer = {
  score: function (result) {
    var page = result[0], score = result[4];
    if (page === "docs/glossary") return score + 12;
    if (/^docs\/(reports|decisions)\//.test(page) || /^(CHANGELOG|CONTRIBUTING)$/.test(page)) return score - 8;
    if (/^docs\/(reference-|errors|config|runtime|design)/.test(page)) return score - 4;
    return score;
  },
  objNameMatch: 11, objPartialMatch: 6, objPrio: {0: 15, 1: 5, 2: -5}, objPrioDefault: 0,
  title: 15, partialTitle: 7, term: 5, partialTerm: 2,
};
