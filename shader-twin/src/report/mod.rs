//! In: the outcomes of stages. Out: a report that a person or a build server reads.

mod junit;
mod markdown;

use crate::compare::Comparison;
use crate::device::{Adapter, Device};
use crate::error::{Error, Kind, Result};
use crate::mutants::Mutants;
use std::fmt;
use std::path::Path;

/// What [`crate::Pair::run`] gave for one stage.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Name of the stage.
    pub stage: String,
    /// What the contract found, or what stopped the run.
    pub errors: Vec<Error>,
    /// The cases, where they ran.
    pub comparison: Option<Comparison>,
    /// The mutants, where they ran.
    pub mutants: Option<Mutants>,
    /// Wall time, seconds.
    pub seconds: f64,
}

impl Outcome {
    pub(crate) fn new(stage: &str) -> Outcome {
        Outcome { stage: stage.into(), errors: Vec::new(), comparison: None, mutants: None, seconds: 0.0 }
    }

    /// Contract, cases and mutants ran, and each passed.
    pub fn passed(&self) -> bool {
        let cases = self.comparison.as_ref().is_some_and(Comparison::passed);
        self.errors.is_empty() && cases && self.mutants.as_ref().is_some_and(Mutants::passed)
    }
}

/// What failed, one line each, or a line of counts.
impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = if self.passed() { "passed" } else { "failed" };
        write!(f, "{}: {verdict} in {:.1} s", self.stage, self.seconds)?;
        for e in &self.errors {
            write!(f, "\n  {e}")?;
        }
        if let Some(comparison) = &self.comparison {
            write!(f, "\n  {} cases on {}", comparison.cases.len(), comparison.adapter)?;
            for case in comparison.cases.iter().filter(|c| !c.passed()) {
                write!(f, "\n  case '{}': {}", case.name, case.line())?;
            }
        }
        if let Some(mutants) = &self.mutants {
            write!(f, "\n  {}", mutants.line())?;
            for mutant in &mutants.survivors {
                write!(f, "\n  survived: {}", mutant.line())?;
            }
            for stale in &mutants.stale {
                write!(f, "\n  explanation without need or reason: {stale}")?;
            }
        }
        Ok(())
    }
}

/// The outcomes of one run on one adapter.
#[derive(Clone, Debug)]
pub struct Report {
    /// For the report's heading.
    pub title: String,
    /// The adapter; `None` where the run was skipped.
    pub adapter: Option<Adapter>,
    /// Why nothing ran, where the caller allowed that.
    pub skipped: Option<String>,
    /// Each stage.
    pub outcomes: Vec<Outcome>,
}

impl Report {
    /// An empty report of a device.
    pub fn new(title: &str, device: &Device) -> Report {
        Report { title: title.into(), adapter: Some(device.adapter().clone()), skipped: None, outcomes: Vec::new() }
    }

    /// The report of a run that had no adapter.
    pub fn skipped(title: &str, reason: &str) -> Report {
        Report { title: title.into(), adapter: None, skipped: Some(reason.into()), outcomes: Vec::new() }
    }

    /// Adds the outcome of a stage.
    pub fn add(&mut self, outcome: Outcome) {
        self.outcomes.push(outcome);
    }

    /// Something ran, and all of it passed. A skipped run has not passed.
    pub fn passed(&self) -> bool {
        !self.outcomes.is_empty() && self.outcomes.iter().all(Outcome::passed)
    }

    /// JUnit XML: a suite for each stage, a test for its contract, for each case and for the mutants.
    pub fn junit(&self) -> String {
        junit::written(self)
    }

    /// Markdown with tables of cases and survivors.
    pub fn markdown(&self) -> String {
        markdown::written(self)
    }

    /// Writes `junit.xml` and `report.md` into a folder, which is made where it is missing.
    ///
    /// # Errors
    ///
    /// [`Kind::File`] with the path that cannot be written.
    pub fn write(&self, folder: &Path) -> Result<()> {
        let fault = |path: &Path, e: std::io::Error| {
            Error::new(Kind::File, format!("{} cannot be written: {e}", path.display()))
        };
        std::fs::create_dir_all(folder).map_err(|e| fault(folder, e))?;
        for (name, text) in [("junit.xml", self.junit()), ("report.md", self.markdown())] {
            let path = folder.join(name);
            std::fs::write(&path, text).map_err(|e| fault(&path, e))?;
        }
        Ok(())
    }
}

/// All outcomes, one below the other.
impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.skipped {
            Some(reason) => write!(f, "{}: SKIPPED, no shader was tested: {reason}", self.title)?,
            None => write!(f, "{}:", self.title)?,
        }
        self.outcomes.iter().try_for_each(|o| write!(f, "\n{o}"))
    }
}
