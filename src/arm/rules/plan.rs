//! In: legs that belong together, and what they rest on. Out: a plan with a hash, which a person confirms.
//! Frame and unit: base_from_flange, mm; mm/s.

use super::super::Motion;
use crate::fault::Gate;
use crate::geometry::{Base, Flange, Rigid, Vec3};
use sha2::{Digest, Sha256};
use std::time::Instant;

/// What a motion rests on beside the robot itself.
#[derive(Clone, Debug, Default)]
pub struct Evidence {
    /// Of the surface that is worked on: unit length, away from it; base frame.
    pub normal: Option<Vec3>,
    /// Fingerprint of the station's calibration, and of the calibration that the scan was made with.
    pub fingerprints: Option<(String, String)>,
    /// Since the scan, s.
    pub scan_age_s: Option<f64>,
    /// What was measured, each with its limit: score, second best, sigma against tolerance.
    pub measured: Vec<Gate>,
}

/// Motions that are shown and confirmed as one.
#[derive(Clone, Debug)]
pub struct Plan {
    /// One or two words.
    pub name: String,
    /// Why, in a sentence.
    pub why: String,
    /// One after the other; each begins where the one before ends.
    pub legs: Vec<Motion>,
    /// The tool on the flange, where there is one: it has to stay out of keep-outs too.
    pub tool_at: Option<Vec3>,
    /// What it rests on.
    pub evidence: Evidence,
}

impl Plan {
    /// One motion that rests on nothing but the robot.
    pub fn single(name: &str, why: impl Into<String>, leg: Motion) -> Plan {
        Plan { name: name.into(), why: why.into(), legs: vec![leg], tool_at: None, evidence: Evidence::default() }
    }
}

/// A plan that was looked at: its gates, and the hash that a confirmation has to name.
#[derive(Clone, Debug)]
pub struct Proposal {
    /// What is to be done.
    pub plan: Plan,
    /// From where.
    pub from: Rigid<Base, Flange>,
    /// The arm's figure there, where the controller says it.
    pub figure: Option<i32>,
    /// What it has to keep, all of it.
    pub gates: Vec<Gate>,
    /// Why it cannot be made where a gate has no words of its own (reach, controller's errors).
    pub reasons: Vec<String>,
    /// Names this proposal and no other: its poses, speeds and reason, and its number.
    pub hash: String,
    pub(super) shown: Instant,
}

impl Proposal {
    /// Every gate is met.
    pub fn passed(&self) -> bool {
        self.reasons.is_empty() && self.gates.iter().all(|g| g.passed)
    }
    /// What is not met, in words.
    pub fn missed(&self) -> Vec<String> {
        self.gates.iter().filter(|g| !g.passed).map(Gate::words).chain(self.reasons.iter().cloned()).collect()
    }
}

/// A person's yes to one proposal. Used up by the motion.
#[derive(Debug)]
pub struct Confirmation {
    pub(super) hash: String,
}

impl Confirmation {
    /// The yes to the proposal of that hash, as it was shown.
    pub fn of(hash: impl Into<String>) -> Confirmation {
        Confirmation { hash: hash.into() }
    }
}

/// The hash of a plan that was proposed as number `number` from a pose.
pub fn hash(plan: &Plan, from: &Rigid<Base, Flange>, number: u64) -> String {
    let mut sha = Sha256::new();
    sha.update(number.to_le_bytes());
    sha.update((plan.name.len() as u64).to_le_bytes());
    sha.update(&plan.name);
    sha.update(&plan.why);
    let mut pose = |p: &Rigid<Base, Flange>| p.to_rows().iter().for_each(|x| sha.update(x.to_bits().to_le_bytes()));
    pose(from);
    plan.legs.iter().for_each(|leg| pose(&leg.to));
    for leg in &plan.legs {
        sha.update([leg.way as u8]);
        sha.update(leg.speed_mm_s.to_bits().to_le_bytes());
    }
    sha.finalize().iter().map(|b| format!("{b:02x}")).collect()
}
