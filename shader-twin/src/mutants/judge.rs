//! In: a shader with its cases and what the twin makes of them. Out: the outcome of each mutant.

use super::changes::changes;
use super::loops::{bounded, has_loops};
use super::{Explained, Mutant, Mutants};
use crate::case::Case;
use crate::compare::{Rule, compared};
use crate::contract::parsed;
use crate::device::Device;
use crate::error::{Error, Kind, Result};
use crate::pair::run_case;
use crate::stage::Stage;
use crate::words::Words;
use std::collections::HashSet;
use std::time::Duration;
use wgpu::naga::compact::{KeepUnused, compact};

/// How many times more turns a mutant gets than the bound within which the shader passes.
const SPARE: u32 = 4;
/// The first bound that is tried; the next are larger by `SPARE`.
const FIRST_TURNS: u32 = 64;
/// The last bound: four times more still fits the counter.
const MOST_TURNS: u32 = 1 << 28;

/// How a shader's text is tried.
pub(crate) struct Trial<'a> {
    pub stage: &'a Stage,
    pub rule: Option<&'a Rule>,
    /// Each comes with the words that the twin made of it.
    pub cases: Vec<(&'a Case, &'a [Words])>,
    pub time_limit: Duration,
}

/// Runs all mutants of a stage.
pub(crate) fn judged(device: &Device, trial: Trial, explained: &[Explained]) -> Result<Mutants> {
    let stage = trial.stage;
    let cases = trial.cases.clone();
    let mut run = Run { device, trial };
    let mut found = Mutants { turns: run.turns()?, ..Mutants::default() };
    let mut seen = HashSet::from([program(stage, &stage.wgsl, &cases).map_err(|e| run.usage(e))?]);
    for change in changes(&stage.wgsl) {
        let text = change.apply(&stage.wgsl);
        let Ok(tree) = program(stage, &text, &cases) else {
            found.refused += 1;
            continue;
        };
        if !seen.insert(tree) {
            found.same_program += 1;
            continue;
        }
        match run.outcome(&bounded(&text, found.turns))? {
            Outcome::Noticed => found.killed += 1,
            Outcome::TimedOut => found.timed_out += 1,
            Outcome::Refused => found.refused += 1,
            Outcome::Survived => found.survived(Mutant::of(&stage.wgsl, &change), explained),
        }
    }
    if found.total() == 0 {
        return Err(run.usage("the shader offers 0 mutants, at least 1 is needed".into()));
    }
    found.close(explained);
    Ok(found)
}

/// The program of a text without what the entry point does not use, in a form that can be compared.
fn program(stage: &Stage, wgsl: &str, cases: &[(&Case, &[Words])]) -> std::result::Result<String, String> {
    let (mut module, _) = parsed(wgsl)?;
    module.entry_points.retain(|e| e.name == stage.entry);
    // A default that every case replaces is not used.
    for (_, constant) in module.overrides.iter_mut() {
        let name = constant.name.as_deref().unwrap_or("");
        if cases.iter().all(|(case, _)| case.constant(name).is_some()) {
            constant.init = None;
        }
    }
    // Named constants would be kept, used or not.
    module.constants.iter_mut().for_each(|(_, constant)| constant.name = None);
    compact(&mut module, KeepUnused::No);
    Ok(format!("{module:?}"))
}

#[derive(Debug)]
enum Outcome {
    Noticed,
    TimedOut,
    Refused,
    Survived,
}

struct Run<'a> {
    device: &'a Device,
    /// The case that noticed the last mutant comes first.
    trial: Trial<'a>,
}

impl Run<'_> {
    fn usage(&self, what: String) -> Error {
        Error::new(Kind::Usage, format!("{}: {what}", self.trial.stage.name))
    }

    /// The position of the first case that differs from the twin.
    fn differs(&self, wgsl: &str) -> Result<Option<usize>> {
        let mut pipelines = Vec::new();
        for (i, (case, twin)) in self.trial.cases.iter().enumerate() {
            let out = run_case(self.device, self.trial.stage, wgsl, case, &mut pipelines, self.trial.time_limit)?;
            if !compared(self.trial.stage, self.trial.rule, case, &out, twin).passed() {
                return Ok(Some(i));
            }
        }
        Ok(None)
    }

    /// How many turns a mutant may take: found by raising the bound until the shader itself passes.
    fn turns(&mut self) -> Result<u32> {
        if let Some(i) = self.differs(&self.trial.stage.wgsl)? {
            let what = format!("the shader itself differs from its twin in case '{}'", self.trial.cases[i].0.name);
            return Err(self.usage(what).next("run Pair::compare, and correct the shader or the twin first"));
        }
        if !has_loops(&self.trial.stage.wgsl) {
            return Ok(0);
        }
        let mut turns = FIRST_TURNS;
        while self.differs(&bounded(&self.trial.stage.wgsl, turns))?.is_some() {
            if turns >= MOST_TURNS {
                let what = format!("one invocation takes more than {MOST_TURNS} turns in its loops");
                return Err(self.usage(what).next("make the cases smaller"));
            }
            turns *= SPARE;
        }
        Ok(turns * SPARE)
    }

    fn outcome(&mut self, wgsl: &str) -> Result<Outcome> {
        match self.differs(wgsl) {
            Ok(None) => Ok(Outcome::Survived),
            Ok(Some(i)) => {
                self.trial.cases[..=i].rotate_right(1);
                Ok(Outcome::Noticed)
            }
            Err(e) => match e.kind() {
                Kind::Refused => Ok(Outcome::Refused),
                Kind::TimedOut | Kind::Lost => {
                    self.device.revive()?;
                    Ok(Outcome::TimedOut)
                }
                _ => Err(e),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Binding, Shape, Tolerance, Wanted};

    #[test]
    fn after_a_mutant_that_does_not_end_in_time_a_new_device_goes_on() {
        let Some(device) = Device::open_or_skip(&Wanted::from_env().unwrap()).unwrap() else { return };
        let text = "@group(0) @binding(0) var<storage, read_write> words: array<u32>;
            @compute @workgroup_size(1) fn main() { words[0] = 64u; }";
        let words = Binding::read_write("words", Shape::array::<u32>(), Tolerance::exact("whole numbers"));
        let stage = Stage::new("s", text, "main", [1, 1, 1], vec![words]);
        let (case, twin) = (Case::new("c", [64, 1, 1]).with(&[0u32]), [Words::of(&[64u32])]);
        let (stage, cases) = (&stage, vec![(&case, &twin[..])]);
        let trial = Trial { stage, rule: None, cases, time_limit: Duration::from_millis(1) };
        let mut run = Run { device: &device, trial };
        // Every turn needs the one before: at least 20 ms on the fastest GPU.
        let turn = "for (var i = 0u; i < 3000000u; i++) { words[0] = (words[0] ^ (i << 5u)) * 747796405u; }";
        let slow = text.replace("words[0] = 64u;", turn);
        // A busy machine may wake this thread only after the end. More work would be no way out: SwiftShader's next
        // device waits for it.
        assert!((0..5).any(|_| matches!(run.outcome(&slow), Ok(Outcome::TimedOut))));
        run.trial.time_limit = Duration::from_secs(60);
        assert!(matches!(run.outcome("no WGSL"), Ok(Outcome::Refused)));
        assert!(matches!(run.outcome(text), Ok(Outcome::Survived)));
        assert!(matches!(run.outcome(&text.replace("64u", "65u")), Ok(Outcome::Noticed)));
    }
}
