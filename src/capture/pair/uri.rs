//! In: a word that names a source of poses or counts. Out: its meaning.
//! Frame and unit: none.

use std::path::PathBuf;

/// Source of poses while pictures are taken.
#[derive(Clone, Debug, PartialEq)]
pub enum PoseUri {
    /// `tcp://HOST:PORT`: lines from a server at that address.
    Tcp(String),
    /// `lines:PATH`: lines from a pipe or a file.
    Lines(PathBuf),
    /// `sim:SEED?...`: the simulated station with these options.
    Sim(String),
    /// Any other `scheme:...`: a robot on a network.
    Robot(String),
}

impl std::fmt::Display for PoseUri {
    /// The named source without its options.
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
