//! In: events of jobs and bar. Out: what was last seen of bar, jobs and results.
//! Frame and unit: those of the events.

use serde_json::Value;

/// What the metrics are read from. Null: not known.
#[derive(Default)]
pub struct Seen {
    /// The bar.
    pub bar: Value,
    /// The job that runs, or the one that changed last.
    pub job: Value,
    /// The last job that found or inserted a part.
    pub result: Value,
    /// The last scan that is done.
    pub scan: Value,
    /// Pictures a second of the camera.
    pub rate_hz: Option<f64>,
}

impl Seen {
    /// Takes an event. True: others hear of it now; progress of a job waits for the next bar.
    pub fn take(&mut self, mut event: Value) -> bool {
        let data = event["data"].take();
        match event["event"].as_str() {
            Some("bar") => {
                self.bar = data;
                true
            }
            Some("job") => self.job(data),
            Some("gone") => self.gone(&data),
            _ => false,
        }
    }

    /// Takes a job as it is now.
    pub fn job(&mut self, job: Value) -> bool {
        if job["state"] == "done" {
            match job["outcome"]["procedure"].as_str() {
                Some("find" | "insert") => self.result = job.clone(),
                Some("scan") => self.scan = job.clone(),
                _ => {}
            }
        }
        // A job that waits does not hide the one that runs.
        if self.job["state"] == "running" && self.job["id"] != job["id"] && job["state"] == "queued" {
            return false;
        }
        let changed = ["id", "state"].iter().any(|key| self.job[*key] != job[*key]);
        self.job = job;
        changed
    }

    /// A job was removed from the disk. Its results stay until there are others.
    fn gone(&mut self, id: &Value) -> bool {
        let shown = self.job["id"] == *id && !id.is_null();
        if shown {
            self.job = Value::Null;
        }
        shown
    }

    /// The part that the last result has.
    pub fn part(&self) -> &Value {
        let outcome = &self.result["outcome"];
        if outcome["procedure"] == "insert" { &outcome["found"] } else { outcome }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn job(id: &str, procedure: &str, state: &str) -> Value {
        json!({"event": "job", "data": {"id": id, "state": state, "outcome": {"procedure": procedure, "score": 0.5}}})
    }

    #[test]
    fn a_running_job_is_not_hidden_by_one_that_waits_and_results_stay() {
        let mut seen = Seen::default();
        assert!(seen.take(job("1", "find", "queued")) && seen.take(job("1", "find", "running")));
        // Progress.
        assert!(!seen.take(job("1", "find", "running")));
        assert!(!seen.take(job("2", "check", "queued")) && seen.job["id"] == "1");
        assert!(seen.take(job("1", "find", "done")) && seen.take(job("2", "check", "running")));
        assert_eq!((&seen.result["id"], &seen.part()["score"], &seen.scan), (&json!("1"), &json!(0.5), &Value::Null));
        assert!(seen.take(job("3", "scan", "done")) && seen.scan["id"] == "3" && seen.result["id"] == "1");
        assert!(seen.take(job("4", "insert", "done")) && seen.part().is_null());
        assert!(!seen.take(json!({"event": "gone", "data": "1"})) && seen.job["id"] == "4");
        assert!(seen.take(json!({"event": "gone", "data": "4"})) && seen.job.is_null() && seen.result["id"] == "4");
        assert!(!seen.take(json!({"event": "motion", "data": {}})));
    }
}
