//! In: the word that names where poses or counts come from. Out: what it means.
//! Frame and unit: none.

use std::path::PathBuf;

/// Where poses come from while pictures are taken.
#[derive(Clone, Debug, PartialEq)]
pub enum PoseUri {
    /// `tcp://HOST:PORT`: lines from a server there.
    Tcp(String),
    /// `lines:PATH`: lines from a pipe or a file.
    Lines(PathBuf),
    /// `sim:SEED?...`: the simulated station of the same words.
    Sim(String),
    /// Any other `scheme:...`: a robot on a wire.
    Robot(String),
}

impl std::fmt::Display for PoseUri {
    /// Whom it names, without what is asked of it.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let place = |s: &str| s.split('?').next().unwrap_or_default().to_owned();
        match self {
            PoseUri::Tcp(address) => write!(f, "tcp://{address}"),
            PoseUri::Lines(path) => write!(f, "lines:{}", path.display()),
            PoseUri::Sim(word) | PoseUri::Robot(word) => f.write_str(&place(word)),
        }
    }
}

impl std::str::FromStr for PoseUri {
    type Err = String;
    fn from_str(s: &str) -> Result<PoseUri, String> {
        let (scheme, rest) = s.split_once(':').ok_or_else(|| {
            format!("'{s}' names no source of poses: tcp://HOST:PORT, lines:PATH, or a robot (bcap://HOST)")
        })?;
        Ok(match scheme {
            "tcp" => PoseUri::Tcp(rest.trim_start_matches('/').into()),
            "lines" => PoseUri::Lines(rest.into()),
            "sim" => PoseUri::Sim(s.into()),
            _ => PoseUri::Robot(s.into()),
        })
    }
}
