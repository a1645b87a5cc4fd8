//! In: a stage, its CPU twin and its cases. Out: whether they agree, and whether the cases notice a changed shader.

use crate::case::Case;
use crate::compare::{Comparison, Rule, compared};
use crate::contract::disagreements;
use crate::device::Device;
use crate::error::{Error, Kind, Result};
use crate::mutants::{Explained, Mutants};
use crate::report::Outcome;
use crate::stage::{Access, Stage};
use crate::words::Words;
use std::time::{Duration, Instant};

/// The same arithmetic as the shader's, on the CPU: changes the content of the writable bindings as the dispatch does.
pub(crate) type Twin = Box<dyn Fn(&mut [Words], &Case)>;

/// A shader, its CPU twin, and the cases on which the two are compared.
pub struct Pair {
    /// The shader's side.
    pub stage: Stage,
    twin: Twin,
    cases: Vec<Case>,
    explained: Vec<Explained>,
    time_limit: Duration,
    rule: Option<(Rule, String)>,
}

impl Pair {
    /// Time that one case may take on the device unless [`Pair::time_limit`] says otherwise.
    pub const TIME_LIMIT: Duration = Duration::from_secs(20);

    /// The twin is given the content of all bindings, in the stage's order, and the case; it changes the content as
    /// the dispatch does. It panics where the content is not what it expects ([`Words::get`]).
    pub fn new(stage: Stage, twin: impl Fn(&mut [Words], &Case) + 'static, cases: Vec<Case>) -> Pair {
        Pair { stage, twin: Box::new(twin), cases, explained: Vec::new(), time_limit: Self::TIME_LIMIT, rule: None }
    }

    /// Sets the longest time that one case may take on the device; a mutant that takes longer counts as noticed.
    pub fn time_limit(mut self, limit: Duration) -> Pair {
        self.time_limit = limit;
        self
    }

    /// Judges a case as a whole, in place of the bindings' tolerances: for lists in an order that is left to the
    /// device, for results that only together have a meaning. The rule is given the case and the content of all
    /// bindings, the device's first; its distance may be at most `limit`. It must not panic, whatever the device wrote:
    /// a mutant may have written anything.
    pub fn judged_by(
        mut self,
        rule: impl Fn(&Case, &[Words], &[Words]) -> f64 + 'static,
        limit: f64,
        reason: &str,
    ) -> Pair {
        self.rule = Some((Rule { apart: Box::new(rule), limit }, reason.into()));
        self
    }

    /// Names a mutant that computes the same as the shader, with the reason: the line of the shader that it changes,
    /// before and after, without blanks at both ends. Every such line of the shader is meant. An explanation that no
    /// survivor needs is an error of the run, so that the list stays true.
    pub fn explain(mut self, was: &str, now: &str, reason: &str) -> Pair {
        self.explained.push(Explained { was: was.trim().into(), now: now.trim().into(), reason: reason.into() });
        self
    }

    /// What the shader's text, the stage's declaration and the cases disagree about. Empty: they agree. Needs no
    /// device.
    pub fn check(&self) -> Vec<Error> {
        let mut found = disagreements(&self.stage, &self.cases);
        if self.rule.as_ref().is_some_and(|(_, reason)| reason.trim().is_empty()) {
            found.push(Error::new(Kind::Contract, format!("{}: the stage's own rule has no reason", self.stage.name)));
        }
        if self.cases.is_empty() {
            found.push(Error::new(Kind::Usage, format!("{}: 0 cases, at least 1 is needed", self.stage.name)));
        }
        for case in &self.cases {
            let place = format!("{}: case '{}'", self.stage.name, case.name);
            let mut say = |what: String| found.push(Error::new(Kind::Contract, format!("{place}: {what}")));
            if case.bindings.len() != self.stage.bindings.len() {
                say(format!("{} bindings are given, {} declared", case.bindings.len(), self.stage.bindings.len()));
            }
            for (binding, words) in self.stage.bindings.iter().zip(&case.bindings) {
                if let Some(need) = binding.shape.unfit(words.bytes()) {
                    say(format!("binding '{}' has {} bytes; {need}", binding.name, words.bytes()));
                }
            }
            for (name, _) in case.overrides.iter().filter(|(name, _)| !self.stage.overrides.contains(name)) {
                say(format!("'{name}' is set, which is no declared override constant"));
            }
        }
        found
    }

    /// Runs every case on the device and on the twin.
    ///
    /// # Errors
    ///
    /// [`Kind::Contract`] with all that [`Pair::check`] found; [`Kind::Usage`] where the twin changes nothing in any
    /// case, or changes what the shader only reads; otherwise what the device refused. Results that differ are no
    /// error: [`Comparison::passed`] tells.
    pub fn compare(&self, device: &Device) -> Result<Comparison> {
        self.agreed()?;
        device.revive()?;
        let expected = self.expected()?;
        let mut cases = Vec::new();
        let mut compiled = Vec::new();
        for (case, twin) in self.cases.iter().zip(&expected) {
            let out = run_case(device, &self.stage, &self.stage.wgsl, case, &mut compiled, self.time_limit)?;
            cases.push(compared(&self.stage, self.rule.as_ref().map(|r| &r.0), case, &out, twin));
        }
        Ok(Comparison { adapter: device.adapter().clone(), cases })
    }

    /// Changes one operator or constant of the shader at a time and runs the cases on each such mutant, until a case
    /// differs from the twin. See [`Mutants`] for what is changed and how endless loops are bounded.
    ///
    /// # Errors
    ///
    /// As [`Pair::compare`]; [`Kind::Usage`] where the shader itself does not pass its cases, or offers nothing to
    /// change.
    pub fn mutate(&self, device: &Device) -> Result<Mutants> {
        self.agreed()?;
        device.revive()?;
        let expected = self.expected()?;
        let cases: Vec<(&Case, &[Words])> = self.cases.iter().zip(expected.iter().map(Vec::as_slice)).collect();
        let trial = crate::mutants::Trial {
            stage: &self.stage,
            rule: self.rule.as_ref().map(|r| &r.0),
            cases,
            time_limit: self.time_limit,
        };
        crate::mutants::judged(device, trial, &self.explained)
    }

    /// All three: [`Pair::check`], [`Pair::compare`], and [`Pair::mutate`] where the comparison passed.
    pub fn run(&self, device: &Device) -> Outcome {
        let begin = Instant::now();
        let mut outcome = Outcome::new(&self.stage.name);
        outcome.errors = self.check();
        if outcome.errors.is_empty() {
            match self.compare(device) {
                Err(e) => outcome.errors.push(e),
                Ok(comparison) => {
                    let passed = comparison.passed();
                    outcome.comparison = Some(comparison);
                    if passed {
                        self.mutate(device).map_or_else(|e| outcome.errors.push(e), |m| outcome.mutants = Some(m));
                    }
                }
            }
        }
        outcome.seconds = begin.elapsed().as_secs_f64();
        outcome
    }

    fn agreed(&self) -> Result<()> {
        let found = self.check();
        if found.is_empty() {
            return Ok(());
        }
        let lines: Vec<String> = found.iter().map(Error::to_string).collect();
        Err(Error::new(Kind::Contract, lines.join("\n")))
    }

    /// What the twin makes of each case.
    fn expected(&self) -> Result<Vec<Vec<Words>>> {
        let usage = |what: String| Error::new(Kind::Usage, format!("{}: {what}", self.stage.name));
        let mut changes = false;
        let mut all = Vec::new();
        for case in &self.cases {
            let mut words = case.bindings.clone();
            (self.twin)(&mut words, case);
            for (i, binding) in self.stage.bindings.iter().enumerate() {
                let same = words[i] == case.bindings[i];
                if binding.access == Access::ReadWrite {
                    changes |= !same;
                } else if !same {
                    let what = format!("the twin changes '{}', which the shader only reads", binding.name);
                    return Err(usage(what).next("correct the twin"));
                }
                if words[i].bytes() != case.bindings[i].bytes() {
                    return Err(usage(format!("the twin changes the length of '{}'", binding.name)));
                }
            }
            all.push(words);
        }
        if !changes {
            return Err(usage("the twin changes no word in any case, at least 1 is needed".into())
                .cause("the twin is a stub, or every case is empty")
                .next("add a case with work to do: a device that does nothing would pass these"));
        }
        Ok(all)
    }
}

/// Pipelines of one text, by the values of their override constants.
pub(crate) type Pipelines = Vec<(Vec<(String, f64)>, crate::device::Compiled)>;

/// Runs a case; cases with the same override constants share a pipeline.
pub(crate) fn run_case(
    device: &Device,
    stage: &Stage,
    wgsl: &str,
    case: &Case,
    pipelines: &mut Pipelines,
    time_limit: Duration,
) -> Result<Vec<Words>> {
    if !pipelines.iter().any(|(overrides, _)| *overrides == case.overrides) {
        pipelines.push((case.overrides.clone(), device.compile(stage, wgsl, &case.overrides)?));
    }
    let (_, compiled) = pipelines.iter().find(|(o, _)| *o == case.overrides).expect("it was just compiled");
    device.run(compiled, stage, case, time_limit)
}
