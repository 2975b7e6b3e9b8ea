# SPDX-License-Identifier: Apache-2.0
"""Paired comparisons: trimmed means with bootstrap intervals, signed ranks, and the control of false alarms."""
import math
import random
import statistics

_NORMAL = statistics.NormalDist()
# Of each end. A fifth is the usual choice for tails of unknown weight [Wilcox2012].
TRIM = 0.2
# Intervals of 95 %: 2000 give their ends to a few hundredths of their length [Efron1993, ch. 14].
RESAMPLES = 2000
# From here on the normal distribution is as good as the exact one.
_EXACT_AT_MOST = 25


def trimmed_mean(values):
    """Mean without the largest and smallest fifth; NaN where one is."""
    if any(map(math.isnan, values)):
        return math.nan
    ordered = sorted(values)
    cut = int(TRIM * len(ordered))
    return statistics.fmean(ordered[cut:len(ordered) - cut])


def bca_interval(values, statistic=trimmed_mean, seed=1):
    """95 % interval by the bias-corrected and accelerated bootstrap [Efron1987]. The same each time."""
    n, found = len(values), statistic(values)
    if n < 2 or min(values) == max(values) or math.isnan(found):
        return found, found
    source = random.Random(seed)
    resampled = sorted(statistic(source.choices(values, k=n)) for _ in range(RESAMPLES))
    below = sum(value < found for value in resampled) + 0.5 * sum(value == found for value in resampled)
    bias = _NORMAL.inv_cdf(min(max(below / RESAMPLES, 1 / RESAMPLES), 1 - 1 / RESAMPLES))
    without = _jackknife(values, statistic)
    middle = statistics.fmean(without)
    squares = sum((middle - value) ** 2 for value in without)
    skew = sum((middle - value) ** 3 for value in without) / (6 * squares ** 1.5) if squares > 0 else 0

    def end(z):
        return resampled[min(int(RESAMPLES * _NORMAL.cdf(bias + (bias + z) / (1 - skew * (bias + z)))), RESAMPLES - 1)]
    return end(_NORMAL.inv_cdf(0.025)), end(_NORMAL.inv_cdf(0.975))


def _jackknife(values, statistic):
    """The statistic without each value; of many values, without each of 100 groups, which costs less."""
    groups = min(len(values), 100)
    return [statistic([value for i, value in enumerate(values) if i % groups != k]) for k in range(groups)]


def signed_rank(differences):
    """Two-sided p of Wilcoxon's signed-rank test [Wilcoxon1945]: differences of 0 are left out; ties have their mean rank.
    NaN where one is."""
    if any(map(math.isnan, differences)):
        return math.nan
    values = sorted((d for d in differences if d != 0), key=abs)
    n = len(values)
    if n == 0:
        return 1.0
    ranks, at, ties = [0.0] * n, 0, 0.0
    while at < n:
        end = at
        while end < n and abs(values[end]) == abs(values[at]):
            end += 1
        for i in range(at, end):
            ranks[i] = (at + end + 1) / 2
        ties += (end - at) ** 3 - (end - at)
        at = end
    plus = sum(rank for rank, value in zip(ranks, values) if value > 0)
    if n <= _EXACT_AT_MOST and ties == 0:
        return _exact_rank(n, min(plus, n * (n + 1) / 2 - plus))
    variance = n * (n + 1) * (2 * n + 1) / 24 - ties / 48
    off = max(0.0, abs(plus - n * (n + 1) / 4) - 0.5)
    return math.erfc(off / math.sqrt(2 * variance))


def _exact_rank(n, smaller):
    counts = [1]
    for rank in range(1, n + 1):
        longer = counts + [0] * rank
        for i, count in enumerate(counts):
            longer[i + rank] += count
        counts = longer
    return min(1.0, 2 * sum(counts[:int(smaller) + 1]) / 2 ** n)


def sign_test(more, fewer):
    """Two-sided p that `more` of the changes go one way and `fewer` the other, if both were as likely [McNemar1947]."""
    n, smaller = more + fewer, min(more, fewer)
    return min(1.0, 2 * sum(math.comb(n, k) for k in range(smaller + 1)) / 2 ** n) if n else 1.0


def holm(p_values):
    """p of each test such that all of them together give a false alarm at the stated rate [Holm1979]. NaN where one is."""
    if any(map(math.isnan, p_values)):
        return [math.nan] * len(p_values)
    order = sorted(range(len(p_values)), key=lambda i: p_values[i])
    out, least = [1.0] * len(p_values), 0.0
    for place, i in enumerate(order):
        least = max(least, min(1.0, (len(p_values) - place) * p_values[i]))
        out[i] = least
    return out
