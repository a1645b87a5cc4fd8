//! In: legs that belong together, and their evidence. Out: a plan with a hash, which a person confirms.
//! Frame and unit: base_from_flange, mm; mm/s.

use super::super::Motion;
use super::carried::Carried;
use crate::fault::Gate;
use crate::geometry::{Base, Flange, Rigid, Vec3};
use sha2::{Digest, Sha256};
use std::time::Instant;

/// What a motion is based on besides the robot itself.
#[derive(Clone, Debug, Default)]
pub struct Evidence {
    /// Unit normal of the surface that is worked on, pointing away from it; base frame.
    pub normal: Option<Vec3>,
    /// Fingerprint of the station's calibration, and of the calibration that the scan was made with.
    pub fingerprints: Option<(String, String)>,
    /// Time since the scan, s.
    pub scan_age_s: Option<f64>,
    /// Measured values with their limits: score, second best, sigma against tolerance.
    pub measured: Vec<Gate>,
}

/// Motions that are shown and confirmed as one.
#[derive(Clone, Debug)]
pub struct Plan {
    /// One or two words.
    pub name: String,
    /// The reason, in one sentence.
    pub why: String,
    /// The legs in order; each begins where the one before ends.
    pub legs: Vec<Motion>,
    /// What the plan is based on.
    pub evidence: Evidence,
}

impl Plan {
    /// One motion that is based on nothing but the robot.
    pub fn single(name: &str, why: impl Into<String>, leg: Motion) -> Plan {
        Plan { name: name.into(), why: why.into(), legs: vec![leg], evidence: Evidence::default() }
    }
}

/// A plan that was examined: its gates, and the hash that a confirmation has to name.
#[derive(Clone, Debug)]
pub struct Proposal {
    /// The plan.
    pub plan: Plan,
    /// Pose of the flange where it starts.
    pub from: Rigid<Base, Flange>,
    /// The arm's figure there, if the controller reports it.
    pub figure: Option<i32>,
    /// All gates that the plan has to meet.
    pub gates: Vec<Gate>,
    /// Reasons against the motion that no gate expresses (reach, controller's errors).
    pub reasons: Vec<String>,
    /// What was not judged, in words: no gate covers it, and the person who confirms has to know.
    pub unjudged: Vec<String>,
    /// Identifies this proposal and no other: poses, speeds, reason, evidence, carried points and number of the
    /// proposal.
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

/// A person's confirmation of one proposal. The motion consumes it.
#[derive(Debug)]
pub struct Confirmation {
    pub(super) hash: String,
}

impl Confirmation {
    /// Confirms the proposal of that hash as it was shown.
    pub fn of(hash: impl Into<String>) -> Confirmation {
        Confirmation { hash: hash.into() }
    }
}

/// The hash of a plan that was proposed as number `number` from a pose.
pub fn hash(plan: &Plan, carried: &Carried, from: &Rigid<Base, Flange>, number: u64) -> String {
    let Plan { name, why, legs, evidence } = plan;
    let mut sha = Sha256::new();
    let mut text = |t: &str| {
        sha.update((t.len() as u64).to_le_bytes());
        sha.update(t);
    };
    text(name);
    text(why);
    let (station, scan) = evidence.fingerprints.as_ref().map_or(("", ""), |f| (&f.0, &f.1));
    [station, scan].into_iter().for_each(&mut text);
    evidence.measured.iter().for_each(|gate| text(gate.name));
    carried.unknown().iter().for_each(|why| text(why));
    // Each list is preceded by its length, so that no number can count as one of another list.
    let mut numbers = |list: &[f64]| {
        sha.update((list.len() as u64).to_le_bytes());
        list.iter().for_each(|x| sha.update(x.to_bits().to_le_bytes()));
    };
    numbers(&from.to_rows());
    for leg in legs {
        numbers(&leg.to.to_rows());
        numbers(&[f64::from(leg.way as u8), leg.speed_mm_s]);
    }
    numbers(evidence.normal.as_ref().map_or(&[][..], |n| n.as_slice()));
    numbers(evidence.scan_age_s.as_slice());
    evidence.measured.iter().for_each(|gate| numbers(&[gate.value, gate.limit]));
    carried.points().for_each(|p| numbers(p.as_slice()));
    sha.update(number.to_le_bytes());
    sha.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::super::super::Way;
    use super::*;

    #[test]
    fn a_hash_names_everything_that_a_person_is_shown() {
        let pose = |x: f64| Rigid::from_vectors(&Vec3::new(0.1, 0.2, 0.3), Vec3::new(x, 0.0, 400.0));
        let leg = Motion { to: pose(300.0), way: Way::Straight, speed_mm_s: 50.0 };
        let plan = Plan::single("a", "b", leg);
        let with = |change: &dyn Fn(&mut Plan)| {
            let mut other = plan.clone();
            change(&mut other);
            other
        };
        let carried = |tool: f64| Carried::new(Some(Vec3::new(0.0, 0.0, tool)), Ok(vec![]));
        let measured = |value, limit| move |p: &mut Plan| p.evidence.measured.push(Gate::least("score", value, limit));
        let plans = [
            plan.clone(),
            with(&|p| p.name = "ab".into()),
            with(&|p| p.why = "c".into()),
            with(&|p| p.legs.push(leg)),
            with(&|p| p.legs[0].speed_mm_s = 49.0),
            with(&|p| p.legs[0].way = Way::Joint),
            with(&|p| p.evidence.normal = Some(Vec3::z())),
            with(&|p| p.evidence.fingerprints = Some(("a".into(), "b".into()))),
            with(&|p| p.evidence.scan_age_s = Some(1.0)),
            with(&measured(0.5, 0.4)),
            with(&measured(0.5, 0.3)),
            with(&measured(0.6, 0.4)),
        ];
        let mut hashes: Vec<String> = plans.iter().map(|p| hash(p, &carried(160.0), &pose(310.0), 1)).collect();
        hashes.push(hash(&plan, &carried(161.0), &pose(310.0), 1));
        hashes.push(hash(&plan, &Carried::new(None, Ok(vec![])), &pose(310.0), 1));
        hashes.push(hash(&plan, &carried(160.0), &pose(311.0), 1));
        hashes.push(hash(&plan, &carried(160.0), &pose(310.0), 2));
        let all = hashes.len();
        hashes.sort();
        hashes.dedup();
        assert_eq!(hashes.len(), all);
    }
}
