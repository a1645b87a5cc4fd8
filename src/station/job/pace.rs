//! In: a step, a speed, the capabilities of camera, chain and arm. Out: matching speed, step and picture rate, and
//! which of the three limits them. Pure.
//! Frame and unit: mm/s, mm a shot, pictures a second (Hz), s.

use crate::fault::{Fault, Result};

/// The limits of camera, chain and motion; `None`: unknown.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Can {
    /// The camera's picture rate, Hz.
    pub camera_hz: Option<f64>,
    /// The picture rate measured on this machine, Hz.
    pub chain_hz: Option<f64>,
    /// Fastest motion that the station allows, mm/s.
    pub speed_mm_s: Option<f64>,
}

/// Speed of a scan that does not stop for its pictures.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Pace {
    /// Speed of the moving part, mm/s.
    pub speed_mm_s: f64,
    /// Distance between shots, mm.
    pub step_mm: f64,
    /// Required picture rate, Hz.
    pub rate_hz: f64,
    /// Duration over the whole length, s.
    pub seconds: f64,
    /// camera, chain or speed: the one that limits the pace or is exceeded by it; `None`: no known limit is
    /// reached.
    pub limited_by: Option<&'static str>,
    /// The fastest speed that each of them allows at this step, mm/s.
    pub bears: Vec<(&'static str, f64)>,
    /// The step that results at this speed if camera or chain are too slow, mm.
    pub left_step_mm: f64,
}

/// The pace at a step over a length; without a speed the fastest that all limits allow.
///
/// # Errors
/// A step, length or speed that is not positive and finite; without a speed: no limit is known.
pub fn pace(step_mm: f64, speed_mm_s: Option<f64>, length_mm: f64, can: &Can) -> Result<Pace> {
    let stated = [("step", Some(step_mm)), ("length", Some(length_mm)), ("speed", speed_mm_s)];
    let rates = [("camera's rate", can.camera_hz), ("chain's rate", can.chain_hz), ("limit of speed", can.speed_mm_s)];
    let none = |v: &f64| !(*v > 0.0 && v.is_finite());
    if let Some((name, v)) = stated.iter().chain(&rates).find_map(|(n, v)| v.filter(none).map(|v| (n, v))) {
        return Err(Fault::usage(format!("the {name} is {v}, more than 0 is needed")).next("correct the number"));
    }
    let by_rate = |name, hz: Option<f64>| hz.map(|hz| (name, hz * step_mm));
    let all = [by_rate("camera", can.camera_hz), by_rate("chain", can.chain_hz), can.speed_mm_s.map(|v| ("speed", v))];
    let bears: Vec<(&'static str, f64)> = all.into_iter().flatten().collect();
    let least = bears.iter().min_by(|a, b| a.1.total_cmp(&b.1)).copied();
    let speed = speed_mm_s.or(least.map(|l| l.1)).ok_or_else(|| {
        Fault::usage("no speed and no limit of the speed is known")
            .cause("no camera that says its rate, no scan that was measured here, no [motion] in station.toml")
            .next("state a speed, mm/s, or the camera's rate, pictures a second")
    })?;
    let slowest = [can.camera_hz, can.chain_hz].into_iter().flatten().fold(f64::INFINITY, f64::min);
    Ok(Pace {
        speed_mm_s: speed,
        step_mm,
        rate_hz: speed / step_mm,
        seconds: length_mm / speed,
        // Tolerance of a millionth, so that a speed computed from a limit counts as reaching it.
        limited_by: least.filter(|l| speed >= l.1 * (1.0 - 1e-6)).map(|l| l.0),
        bears,
        left_step_mm: step_mm.max(speed / slowest),
    })
}

impl Pace {
    /// The pace as a sentence.
    pub fn words(&self) -> String {
        let mut said = format!(
            "{:.1} mm/s, {:.3} mm a shot, {:.1} pictures a second, {:.1} s",
            self.speed_mm_s, self.step_mm, self.rate_hz, self.seconds
        );
        if let Some(by) = self.limited_by {
            said += &format!("; limited by the {}", if by == "speed" { "limit of speed" } else { by });
        }
        if self.left_step_mm > 1.000_001 * self.step_mm {
            said += &format!(": actual spacing {:.3} mm a shot", self.left_step_mm);
        }
        said
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slowest_of_camera_chain_and_arm_limits() {
        let can = Can { camera_hz: Some(30.0), chain_hz: Some(200.0), speed_mm_s: Some(50.0) };
        let p = pace(0.2, None, 60.0, &can).unwrap();
        assert_eq!((p.limited_by, p.speed_mm_s, p.rate_hz, p.seconds), (Some("camera"), 6.0, 30.0, 10.0));
        assert_eq!(p.bears, [("camera", 6.0), ("chain", 40.0), ("speed", 50.0)]);
        // A coarser step: the arm limits. Slower than all of them: nothing limits.
        assert_eq!(pace(2.0, None, 60.0, &can).unwrap().limited_by, Some("speed"));
        assert_eq!(pace(0.2, Some(5.0), 60.0, &can).unwrap().limited_by, None);
        // Faster than the camera allows: the resulting steps are longer.
        let fast = pace(0.2, Some(12.0), 60.0, &can).unwrap();
        assert_eq!((fast.limited_by, fast.left_step_mm), (Some("camera"), 0.4));
        assert!(fast.words().contains("limited by the camera: actual spacing 0.400 mm a shot"), "{}", fast.words());
        let slow_chain = Can { chain_hz: Some(10.0), ..can };
        assert_eq!(pace(0.2, None, 60.0, &slow_chain).unwrap().limited_by, Some("chain"));
        assert!(pace(0.2, None, 60.0, &Can::default()).unwrap_err().what.contains("known"));
        for (step, speed) in [(0.0, None), (f64::NAN, None), (0.2, Some(-1.0))] {
            assert!(pace(step, speed, 60.0, &can).is_err());
        }
    }
}
