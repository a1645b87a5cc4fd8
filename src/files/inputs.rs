//! In: the path of a result and the paths it is made from. Out: an error if the result would replace one of its
//! inputs.
//! Frame and unit: none.

use crate::fault::{Fault, Result};
use std::path::{Path, PathBuf};

/// Returns an error if `out` is one of `inputs`, by whatever path or link.
pub fn not_over<'a>(out: &Path, inputs: impl IntoIterator<Item = &'a Path>) -> Result<()> {
    let Some(real) = real(out) else { return Ok(()) };
    match inputs.into_iter().find(|i| self::real(i).as_ref() == Some(&real)) {
        None => Ok(()),
        Some(input) => Err(Fault::usage(format!("{}: the result would replace {}", out.display(), input.display()))
            .cause("the same name was given for what is read and what is written")
            .next("give the result another name")),
    }
}

/// Returns an error if `out` lies directly inside `folder` and its name is one that `theirs` claims.
pub fn not_over_any(out: &Path, folder: &Path, theirs: impl Fn(&str) -> bool) -> Result<()> {
    let inside = out.parent().map(|p| if p.as_os_str().is_empty() { Path::new(".") } else { p });
    let same = inside.and_then(real).is_some_and(|p| Some(p) == real(folder));
    let name = out.file_name().unwrap_or_default().to_string_lossy();
    if same && theirs(&name) {
        return Err(Fault::usage(format!("{}: is one of that folder's own files", out.display()))
            .cause("a result was given the name of something that it is made from")
            .next("give the result another name"));
    }
    Ok(())
}

/// The path without links and dots. For a file that does not exist yet, only its folder is resolved.
fn real(path: &Path) -> Option<PathBuf> {
    if let Ok(real) = path.canonicalize() {
        return Some(real);
    }
    let folder = path.parent().map(|p| if p.as_os_str().is_empty() { Path::new(".") } else { p })?;
    Some(folder.canonicalize().ok()?.join(path.file_name()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_read_is_not_replaced_by_any_name() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::write(at("a.toml"), "").unwrap();
        std::fs::create_dir(at("sub")).unwrap();
        assert!(not_over(&at("sub/../a.toml"), [at("a.toml").as_path()]).is_err());
        assert!(not_over(&at("b.json"), [at("a.toml").as_path()]).is_ok());
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(at("a.toml"), at("link")).unwrap();
            assert!(not_over(&at("link"), [at("a.toml").as_path()]).is_err());
        }
        assert!(not_over_any(&at("sub/scan.json"), &at("sub"), |n| n == "scan.json").is_err());
        assert!(not_over_any(&at("sub/pose.json"), &at("sub"), |n| n == "scan.json").is_ok());
        assert!(not_over_any(&at("scan.json"), &at("sub"), |n| n == "scan.json").is_ok());
    }
}
