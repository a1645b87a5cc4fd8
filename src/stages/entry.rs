//! In: a stage, its CPU twin and its cases. Out: how far the GPU and the twin are apart.
//! Frame and unit: words of the stage's bindings; the difference's unit is the stage's own.

use crate::fault::Result;
use crate::gpu::{Device, Pipeline, Stage, Workload, run_once};

/// One stage as the tests and `sheetlight doctor` see it.
pub struct Entry {
    pub stage: &'static Stage,
    /// The same arithmetic on the CPU: changes the bindings in place, the uniform is binding 0.
    pub twin: fn(bindings: &mut [Vec<u32>], overrides: &[(&'static str, f64)]),
    pub cases: fn() -> Vec<Case>,
    /// Difference between two results, and the largest one allowed, with its reason.
    pub compare: fn(gpu: &[Vec<u32>], twin: &[Vec<u32>]) -> f64,
    pub limit: f64,
    pub reason: &'static str,
}

/// Input of one run of a stage.
#[derive(Clone, Debug)]
pub struct Case {
    pub name: String,
    pub overrides: Vec<(&'static str, f64)>,
    pub bindings: Vec<Vec<u32>>,
    pub groups: [u32; 3],
}

/// What the comparison of one stage gave.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Verdict {
    pub stage: &'static str,
    pub cases: usize,
    pub largest_difference: f64,
    pub limit: f64,
    pub reason: &'static str,
    /// The case with the largest difference.
    pub worst_case: String,
}

impl Verdict {
    pub fn passed(&self) -> bool {
        self.largest_difference <= self.limit
    }
}

impl Entry {
    /// Runs every case on the GPU and on the twin.
    pub fn verify(&self, device: &Device) -> Result<Verdict> {
        self.judge(device, (self.cases)())
    }

    /// The same with other cases.
    pub fn judge(&self, device: &Device, cases: Vec<Case>) -> Result<Verdict> {
        // Cases with the same constants share what is compiled for them.
        let mut compiled: Vec<(Vec<(&str, f64)>, Pipeline)> = Vec::new();
        let mut verdict = Verdict {
            stage: self.stage.name,
            cases: 0,
            largest_difference: 0.0,
            limit: self.limit,
            reason: self.reason,
            worst_case: String::new(),
        };
        for case in cases {
            if !compiled.iter().any(|(constants, _)| *constants == case.overrides) {
                compiled.push((case.overrides.clone(), self.stage.pipeline(device, &case.overrides)?));
            }
            let (_, pipeline) = compiled.iter().find(|c| c.0 == case.overrides).expect("just compiled");
            let load = Workload {
                bindings: case.bindings.iter().map(|b| bytemuck::cast_slice(b).to_vec()).collect(),
                groups: case.groups,
            };
            let gpu: Vec<Vec<u32>> =
                run_once(device, pipeline, &load)?.iter().map(|b| bytemuck::pod_collect_to_vec(b)).collect();
            let mut twin = case.bindings;
            (self.twin)(&mut twin, &case.overrides);
            let difference = (self.compare)(&gpu, &twin);
            verdict.cases += 1;
            if difference > verdict.largest_difference || verdict.worst_case.is_empty() {
                verdict.largest_difference = verdict.largest_difference.max(difference);
                verdict.worst_case = case.name;
            }
        }
        Ok(verdict)
    }
}

/// Number of words that differ.
pub fn differing_words(gpu: &[Vec<u32>], twin: &[Vec<u32>]) -> f64 {
    gpu.iter()
        .zip(twin)
        .map(|(a, b)| a.len().abs_diff(b.len()) + a.iter().zip(b).filter(|(a, b)| a != b).count())
        .sum::<usize>() as f64
}

/// As `differing_words`, where some bindings are lists in any order: (binding, words an entry). The number of entries is
/// word 3 of the binding before the list; which tile takes which place is up to the GPU's scheduler.
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
