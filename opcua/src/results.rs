//! In: jobs that ended. Out: the last results, as structures and as plain values. Pure.
//! Frame and unit: poses in mm and degrees in the station's notation; standard deviations in mm and degrees.

use crate::model::data::{
    JobId, MeasId, PartId, ProcessingTimes, ProductId, RecipeIdExternal, RecipeIdInternal, ResultData, ResultId,
};
use opcua::types::{DateTime, Variant, VariantScalarTypeId};
use sheetlight_registers::{Job, Stage};
use std::collections::VecDeque;

/// Most results that are kept; older ones are in the station's folder.
pub const MOST: usize = 32;

/// Values of ResultStateDataType [opc-mv, table 153].
const COMPLETED: i32 = 1;
const ABORTED: i32 = 3;
const FAILED: i32 = 4;

/// What a client said when it started a job.
#[derive(Clone, Debug, PartialEq)]
pub struct Order {
    /// The job's identifier.
    pub job: String,
    pub recipe: String,
    pub meas: Option<MeasId>,
    pub part: Option<PartId>,
    pub product: Option<ProductId>,
    pub begun: DateTime,
}

/// A result.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    pub id: String,
    /// Who started it; nothing of a job that was started elsewhere.
    pub order: Option<Order>,
    pub state: i32,
    /// What the station shows of it.
    pub job: Job,
    /// The tool's poses before and after the insertion, if they were asked for.
    pub approach: Option<[f64; 6]>,
    pub retract: Option<[f64; 6]>,
    pub ended: DateTime,
}

impl Outcome {
    /// The outcome of a job that ended.
    pub fn of(job: Job, order: Option<Order>, [approach, retract]: [Option<[f64; 6]>; 2]) -> Outcome {
        let state = match job.stage {
            Stage::Done => COMPLETED,
            Stage::Stopped | Stage::CutOff => ABORTED,
            _ => FAILED,
        };
        let id = order.as_ref().map_or_else(|| job.number.to_string(), |order| order.job.clone());
        Outcome { id, order, state, job, approach, retract, ended: DateTime::now() }
    }

    /// The recipe's name; empty if the job was started elsewhere.
    pub fn recipe(&self) -> &str {
        self.order.as_ref().map_or("", |order| &order.recipe)
    }

    fn pose(&self) -> Option<[f64; 6]> {
        (self.job.found == 1).then_some(self.job.pose)
    }

    /// Standard deviations; none if no part was seen.
    fn sigma(&self, turns: bool) -> Vec<f64> {
        if self.job.found == 0 {
            return vec![];
        }
        self.job.sigma[if turns { 3..6 } else { 0..3 }].to_vec()
    }

    fn score(&self) -> f64 {
        if self.job.found == 0 { 0.0 } else { self.job.score }
    }

    /// As named values, in the order of the structure's content.
    pub fn values(&self) -> [(&'static str, Variant); 11] {
        [
            ("Found", i32::from(self.job.found).into()),
            ("Pose", doubles(self.pose().map_or(vec![], |p| p.to_vec()))),
            ("Approach", doubles(self.approach.map_or(vec![], |p| p.to_vec()))),
            ("Retract", doubles(self.retract.map_or(vec![], |p| p.to_vec()))),
            ("SigmaMm", doubles(self.sigma(false))),
            ("SigmaDeg", doubles(self.sigma(true))),
            ("GatesJudged", strings(&self.job.judged)),
            ("GatesPassed", strings(&self.job.passed)),
            ("Score", self.score().into()),
            ("Error", i32::from(self.job.error).into()),
            ("ErrorWords", self.job.words.as_str().into()),
        ]
    }

    /// As the specification's structure.
    pub fn data(&self) -> ResultData {
        let order = self.order.as_ref();
        let times = |order: &Order| ProcessingTimes {
            start_time: order.begun,
            end_time: self.ended,
            ..ProcessingTimes::default()
        };
        ResultData {
            result_id: ResultId { id: self.id.as_str().into() },
            result_state: self.state,
            meas_id: order.and_then(|o| o.meas.clone()),
            part_id: order.and_then(|o| o.part.clone()),
            external_recipe_id: order.map(|o| RecipeIdExternal::of(&o.recipe)),
            internal_recipe_id: RecipeIdInternal::of(self.recipe()),
            product_id: order.and_then(|o| o.product.clone()),
            job_id: JobId { id: self.id.as_str().into() },
            creation_time: self.ended,
            processing_times: order.map(times),
            result_content: Some(Some(self.values().into_iter().map(|(_, value)| value).collect())),
            ..ResultData::default()
        }
    }
}

/// An array, with its type also where it is empty.
pub fn doubles(values: Vec<f64>) -> Variant {
    let values: Vec<Variant> = values.into_iter().map(Variant::from).collect();
    Variant::from((VariantScalarTypeId::Double, values))
}

/// The same of words.
pub fn strings<S: AsRef<str>>(values: &[S]) -> Variant {
    let values: Vec<Variant> = values.iter().map(|s| Variant::from(s.as_ref())).collect();
    Variant::from((VariantScalarTypeId::String, values))
}

/// The last results, the newest last.
#[derive(Default)]
pub struct Results(VecDeque<Outcome>);

impl Results {
    /// Keeps a result; one of the same job is replaced.
    pub fn keep(&mut self, outcome: Outcome) {
        self.0.retain(|other| other.id != outcome.id);
        if self.0.len() == MOST {
            self.0.pop_front();
        }
        self.0.push_back(outcome);
    }

    pub fn last(&self) -> Option<&Outcome> {
        self.0.back()
    }

    pub fn find(&self, id: &str) -> Option<&Outcome> {
        self.0.iter().find(|outcome| outcome.id == id)
    }

    /// The newest first.
    pub fn newest_first(&self) -> impl Iterator<Item = &Outcome> {
        self.0.iter().rev()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_results_go_and_one_job_has_one_result() {
        let mut results = Results::default();
        let of = |number: u32, stage: Stage| Outcome::of(Job { number, stage, ..Job::default() }, None, [None, None]);
        for number in 0..40 {
            results.keep(of(number, Stage::Failed));
        }
        assert_eq!((results.0.len(), results.find("7").is_none(), results.find("8").is_some()), (MOST, true, true));
        results.keep(of(20, Stage::Done));
        assert_eq!(results.newest_first().filter(|o| o.id == "20").map(|o| o.state).collect::<Vec<_>>(), [COMPLETED]);
        assert_eq!(results.last().unwrap().id, "20");
        assert_eq!(of(1, Stage::CutOff).state, ABORTED);
    }

    /// A pose of a job whose part missed a gate must not be taken for one.
    #[test]
    fn only_a_found_part_has_a_pose() {
        let job = |found| Job { found, pose: [1.0; 6], sigma: [0.1; 6], score: 0.5, ..Job::default() };
        for (found, pose, sigma) in [(0, 0, 0), (1, 6, 3), (2, 0, 3)] {
            let values = Outcome::of(job(found), None, [None, None]).values();
            let length = |k: usize| match &values[k].1 {
                Variant::Array(a) => a.values.len(),
                other => panic!("{other:?}"),
            };
            assert_eq!((length(1), length(4), length(5)), (pose, sigma, sigma), "{found}");
        }
    }
}
