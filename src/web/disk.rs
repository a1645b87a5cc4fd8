//! In: a folder. Out: how much its disk still takes.
//! Frame and unit: GB of 10^9 bytes.

use std::path::Path;
use std::process::Command;

/// Asks `df`, which every Unix has in the same form; `None` where there is none.
pub fn left_gb(folder: &Path) -> Option<f64> {
    let done = Command::new("df").arg("-Pk").arg(folder).output().ok()?;
    let text = String::from_utf8(done.stdout).ok()?;
    let available = text.lines().nth(1)?.split_whitespace().nth(3)?.parse::<f64>().ok()?;
    Some(available * 1024e-9)
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_disk_says_what_is_left() {
        let left = super::left_gb(std::path::Path::new(".")).expect("df is there");
        assert!(left > 0.0 && left < 1e9, "{left}");
        assert!(super::left_gb(std::path::Path::new("/no/such/folder")).is_none());
    }
}
