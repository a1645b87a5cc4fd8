//! In: nothing. Out: times of a shot measured on other machines, as stored in benches/runs, for comparison with this
//! machine.
//! Frame and unit: ms a shot, one clean stripe.

use super::ways::WayTime;

/// The machine in words, and the output of `sheetlight bench --json` on it.
const RUNS: [(&str, &str); 2] = [
    ("two cores of a Xeon, software Vulkan", include_str!("../../../benches/runs/2026-11-22-2core-xeon/bench.json")),
    ("NVIDIA H100", include_str!("../../../benches/runs/2026-11-22-h100/bench.json")),
];

/// The quantities that `way_times` measures, as far as they were recorded.
pub fn recorded() -> Vec<WayTime> {
    #[derive(serde::Deserialize)]
    struct Row {
        width: u32,
        height: u32,
        scene: String,
        ms_per_shot: f64,
    }
    #[derive(serde::Deserialize)]
    struct Run {
        rows: Vec<Row>,
    }
    let rows = |(on, text): (&str, &str)| {
        let run: Run = serde_json::from_str(text).expect("a file of ours");
        let clean = run.rows.into_iter().filter(|r| r.scene == "one-stripe");
        let time = |r: Row| WayTime {
            on: on.into(),
            width: r.width,
            height: r.height,
            ms_per_shot: r.ms_per_shot,
            cpu_ms_per_shot: None,
        };
        clean.map(time).collect::<Vec<_>>()
    };
    RUNS.into_iter().flat_map(rows).filter(|w| super::ways::SIZES.contains(&(w.width, w.height))).collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_recorded_machine_has_the_full_and_the_half_picture() {
        let all = super::recorded();
        for (on, _) in super::RUNS {
            let ms = |width: u32| all.iter().find(|w| w.on == on && w.width == width).map(|w| w.ms_per_shot);
            assert!(ms(640).unwrap() > 0.0 && ms(640) < ms(1280), "{on}: {all:?}");
        }
    }
}
