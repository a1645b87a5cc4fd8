//! In: what a GPU and what the twin made of the same words. Out: how far they are apart, and how far they may be.
//! Frame and unit: words of the stage's bindings; a stage's own difference has its own unit.

/// When a GPU and the twin have done the same.
#[derive(Clone, Copy, Debug)]
pub enum Same {
    /// Every word is the same.
    Words,
    /// The same but for the order of lists: (binding, words an entry); their number stands in word 3 of the binding
    /// before.
    Lists(&'static [(usize, usize)]),
    /// A difference of its own, the largest allowed, and why.
    Within(fn(gpu: &[Vec<u32>], twin: &[Vec<u32>]) -> f64, f64, &'static str),
}

impl Same {
    /// How far two results are apart.
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

    /// Why results so far apart count as the same.
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

/// As `differing_words`, where some bindings are lists in any order: (binding, words an entry). The number of entries
/// is word 3 of the binding before the list; which tile takes which place is up to the GPU's scheduler.
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
