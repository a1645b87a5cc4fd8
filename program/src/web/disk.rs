//! In: a folder; this process. Out: the free space of its disk; the memory that the process uses.
//! Frame and unit: GB of 10^9 bytes, MB of 10^6.

use std::path::Path;
use std::process::Command;

/// Calls `df`, whose output has the same format on every Unix; `None` if it is missing.
pub fn left_gb(folder: &Path) -> Option<f64> {
    let done = Command::new("df").arg("-Pk").arg(folder).output().ok()?;
    let text = String::from_utf8(done.stdout).ok()?;
    let available = text.lines().nth(1)?.split_whitespace().nth(3)?.parse::<f64>().ok()?;
    Some(available * 1024e-9)
}

/// Memory of this process, now and at its peak; `None` if the system does not report it as Linux does.
pub fn memory_mb() -> Option<[f64; 2]> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let mb = |name: &str| {
        let line = text.lines().find_map(|l| l.strip_prefix(name))?;
        Some(line.split_whitespace().next()?.parse::<f64>().ok()? * 1024e-6)
    };
    Some([mb("VmRSS:")?, mb("VmHWM:")?])
}

#[cfg(test)]
mod tests {
    #[test]
    #[cfg(target_os = "linux")]
    fn memory_that_is_used_is_counted() {
        let [before, _] = super::memory_mb().unwrap();
        let much = std::hint::black_box(vec![1u8; 64 << 20]);
        let [now, most] = super::memory_mb().unwrap();
        assert!(now > before + 40.0 && most >= now && much[1 << 20] == 1, "{before} {now} {most}");
    }

    #[test]
    fn a_disk_says_what_is_left() {
        let left = super::left_gb(std::path::Path::new(".")).expect("df is there");
        assert!(left > 0.0 && left < 1e9, "{left}");
        assert!(super::left_gb(std::path::Path::new("/no/such/folder")).is_none());
    }
}
