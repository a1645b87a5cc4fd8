//! In: the results of a GPU and of the twin for the same words. Out: how much they differ, and how much they may
//! differ. Frame and unit: words of the stage's bindings; a stage's own difference has its own unit.

/// Criterion for equal results of a GPU and the twin.
#[derive(Clone, Copy, Debug)]
pub enum Same {
    /// Every word must be equal.
    Words,
    /// Every word must be equal, but lists may be in any order: (binding, words per entry). The number of entries is
    /// word 3 of the binding before the list.
    Lists(&'static [(usize, usize)]),
    /// The stage's own measure of difference, the largest value allowed, and the reason.
    Within(fn(gpu: &[Vec<u32>], twin: &[Vec<u32>]) -> f64, f64, &'static str),
}

impl Same {
    /// The difference of two results.
    pub fn difference(&self, gpu: &[Vec<u32>], twin: &[Vec<u32>]) -> f64 {
        match self {
            Same::Words => differing_words(gpu, twin),
            Same::Lists(lists) => differing_words_beside_order(gpu, twin, lists),
            Same::Within(apart, ..) => apart(gpu, twin),
        }
    }

    /// The largest difference allowed, in the stage's own unit.
    pub fn limit(&self) -> f64 {
        match self {
            Same::Words | Same::Lists(_) => 0.0,
            Same::Within(_, limit, _) => *limit,
        }
    }

    /// Reason why results within the limit count as equal.
    pub fn reason(&self) -> &'static str {
        match self {
            Same::Words => "whole numbers only: every word is the same",
            Same::Lists(_) => "whole numbers only: the same set, in whatever order the GPU ran",
            Same::Within(.., reason) => reason,
        }
    }
}

/// Number of words that differ.
pub fn differing_words(gpu: &[Vec<u32>], twin: &[Vec<u32>]) -> f64 {
    gpu.iter()
        .zip(twin)
        .map(|(a, b)| a.len().abs_diff(b.len()) + a.iter().zip(b).filter(|(a, b)| a != b).count())
        .sum::<usize>() as f64
}

/// Like `differing_words`, but some bindings are lists in any order: (binding, words per entry). The number of entries
/// is word 3 of the binding before the list. The GPU's scheduler decides the index of each tile.
pub fn differing_words_beside_order(gpu: &[Vec<u32>], twin: &[Vec<u32>], lists: &[(usize, usize)]) -> f64 {
    let sorted = |b: &[Vec<u32>]| {
        let mut b = b.to_vec();
        for &(list, words) in lists {
            let count = b[list - 1][3] as usize * words;
            let mut entries: Vec<Vec<u32>> = b[list][..count].chunks(words).map(<[u32]>::to_vec).collect();
            entries.sort_unstable();
            b[list][..count].copy_from_slice(&entries.concat());
        }
        b
    };
    differing_words(&sorted(gpu), &sorted(twin))
}
