//! In: a stage, its CPU twin and its cases. Out: the difference between the GPU and the twin. Frame and unit: words of
//! the stage's bindings; the difference has the stage's own unit.

use super::same::Same;
use super::step::Twin;
use crate::fault::Result;
use crate::gpu::{Device, Pipeline, Stage, Workload, run_once};

/// One stage with what the tests and `sheetlight doctor` need.
pub struct Entry {
    /// The shader with its bindings.
    pub stage: &'static Stage,
    /// The same arithmetic on the CPU.
    pub twin: Twin,
    /// Makes the inputs on which the two are compared.
    pub cases: Box<dyn Fn() -> Vec<Case> + Send + Sync>,
    /// How much the two may differ.
    pub same: Same,
}

/// Input of one run of a stage.
#[derive(Clone, Debug)]
pub struct Case {
    /// Description of the input, for messages.
    pub name: String,
    /// Override constants with which the pipeline is built: name, value.
    pub overrides: Vec<(&'static str, f64)>,
    /// Words of each binding in the stage's order, the uniform block first.
    pub bindings: Vec<Vec<u32>>,
    /// Workgroups: x, y, z.
    pub groups: [u32; 3],
}

/// Result of the comparison of one stage.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Verdict {
    /// Name of the stage.
    pub stage: &'static str,
    /// Number of cases that ran.
    pub cases: usize,
    /// Largest difference over all cases, in the stage's own unit.
    pub largest_difference: f64,
    /// Largest difference allowed, in the same unit; 0 if every word must be equal.
    pub limit: f64,
    /// Reason why results within the limit count as equal.
    pub reason: &'static str,
    /// The case with the largest difference.
    pub worst_case: String,
}

impl Verdict {
    /// Whether no case differs by more than the limit.
    pub fn passed(&self) -> bool {
        self.largest_difference <= self.limit
    }
}

impl Entry {
    /// Runs every case on the GPU and on the twin.
    pub fn verify(&self, device: &Device) -> Result<Verdict> {
        self.judge(device, (self.cases)())
    }

    /// Like `verify`, with different cases.
    pub fn judge(&self, device: &Device, cases: Vec<Case>) -> Result<Verdict> {
        // Cases with the same constants share a compiled pipeline.
        let mut compiled: Vec<(Vec<(&str, f64)>, Pipeline)> = Vec::new();
        let mut verdict = Verdict {
            stage: self.stage.name,
            cases: 0,
            largest_difference: 0.0,
            limit: self.same.limit(),
            reason: self.same.reason(),
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
            let difference = self.same.difference(&gpu, &twin);
            verdict.cases += 1;
            if difference > verdict.largest_difference || verdict.worst_case.is_empty() {
                verdict.largest_difference = verdict.largest_difference.max(difference);
                verdict.worst_case = case.name;
            }
        }
        Ok(verdict)
    }
}
