//! In: a URI that names a robot's controller. Out: the link to it.
//! Frame and unit: none.

use super::{Arm, denso, file, ur};
use crate::bcap::Network;
use crate::fault::{Fault, Result};
use std::path::PathBuf;

/// The address of a robot.
#[derive(Clone, Debug, PartialEq)]
pub enum RobotUri {
    /// `bcap://HOST[:PORT][?network=udp][&full=MM_S][&turn=DEG_S]`: a Denso controller; `full` and `turn` are the
    /// speeds of straight motions at 100 %.
    Bcap {
        /// HOST:PORT.
        address: String,
        /// Network of motions and readings. Halt always goes over TCP.
        network: Network,
        /// Speed of the flange at 100 %, mm/s.
        full_mm_s: f64,
        /// Turning rate of the flange at 100 %, degrees/s.
        full_deg_s: f64,
    },
    /// `ur://HOST[:PORT]`: poses of a Universal Robots controller, read from its real-time interface. Holds
    /// HOST:PORT.
    Ur(String),
    /// `file:PATH`: poses from a pose file, one for each reading.
    File(PathBuf),
}

/// The b-CAP port, the same on every controller.
const BCAP_PORT: u16 = 5007;
/// The port of Universal Robots' real-time interface.
const UR_PORT: u16 = 30_003;
/// Speed of straight motions at 100 %, mm/s. The VS-060's own value has to be measured; a motion that is faster
/// than requested is halted.
const FULL_MM_S: f64 = 1000.0;
/// Turning rate of straight motions at 100 %, degrees/s.
const FULL_DEG_S: f64 = 200.0;

impl std::str::FromStr for RobotUri {
    type Err = Fault;

    fn from_str(uri: &str) -> Result<RobotUri> {
        let bad = |what: String| {
            Fault::usage(format!("'{uri}': {what}"))
                .next("write bcap://HOST:5007, ur://HOST or file:POSES.json (docs/robots.md)")
        };
        if let Some(path) = uri.strip_prefix("file:") {
            let path = path.strip_prefix("//").unwrap_or(path);
            return if path.is_empty() { Err(bad("names no file".into())) } else { Ok(RobotUri::File(path.into())) };
        }
        let Some((scheme, rest)) = uri.split_once("://") else {
            return Err(bad("is not a robot's address".into()));
        };
        let (host, query) = rest.split_once('?').unwrap_or((rest, ""));
        let host = host.strip_suffix('/').unwrap_or(host);
        if host.is_empty() || host.contains(['/', ' ', '@']) {
            return Err(bad("names no host".into()));
        }
        match scheme {
            "bcap" => {
                let (mut network, mut full_mm_s, mut full_deg_s) = (Network::Tcp, FULL_MM_S, FULL_DEG_S);
                let within = |v: &str, low: f64, high: f64| v.parse().ok().filter(|x| (low..=high).contains(x));
                for (key, value) in
                    query.split('&').filter(|p| !p.is_empty()).map(|p| p.split_once('=').unwrap_or((p, "")))
                {
                    match (key, value) {
                        ("network", "tcp") => network = Network::Tcp,
                        ("network", "udp") => network = Network::Udp,
                        ("full", v) => {
                            full_mm_s = within(v, 50.0, 20_000.0)
                                .ok_or_else(|| bad(format!("full={v}; allowed: 50 to 20000 mm/s")))?;
                        }
                        ("turn", v) => {
                            full_deg_s = within(v, 10.0, 2000.0)
                                .ok_or_else(|| bad(format!("turn={v}; allowed: 10 to 2000 degrees/s")))?;
                        }
                        _ => {
                            return Err(bad(format!(
                                "knows no {key}={value}; there are network=tcp, network=udp, full=MM_S, turn=DEG_S"
                            )));
                        }
                    }
                }
                Ok(RobotUri::Bcap { address: with_port(host, BCAP_PORT).map_err(bad)?, network, full_mm_s, full_deg_s })
            }
            "ur" => Ok(RobotUri::Ur(with_port(host, UR_PORT).map_err(bad)?)),
            other => Err(bad(format!("unknown robot link '{other}'"))),
        }
    }
}

/// HOST:PORT; the port is added if it is missing. IPv6 addresses are written in brackets.
fn with_port(host: &str, port: u16) -> std::result::Result<String, String> {
    let name = host.rsplit_once(']').map_or(host, |(_, after)| after);
    match name.rsplit_once(':') {
        None => Ok(format!("{host}:{port}")),
        Some((_, p)) if p.parse::<u16>().is_ok_and(|p| p > 0) => Ok(host.to_owned()),
        Some((_, p)) => Err(format!("'{p}' is not a port; allowed: 1 to 65535")),
    }
}

/// Opens the link that a URI names. Errors: the URI is not valid, or the controller does not answer.
pub fn open(uri: &str) -> Result<Box<dyn Arm>> {
    Ok(match uri.parse()? {
        RobotUri::Bcap { address, network, full_mm_s, full_deg_s } => {
            let full = denso::Full { mm_s: full_mm_s, deg_s: full_deg_s };
            Box::new(denso::Denso::open(uri, &address, network, full)?)
        }
        RobotUri::Ur(address) => Box::new(ur::UrPoses::open(uri, &address)?),
        RobotUri::File(path) => Box::new(file::PosesOfFile::open(uri, &path)?),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_read_and_slips_are_named() {
        let read = |s: &str| s.parse::<RobotUri>();
        let bcap = |address: &str, network, full_mm_s| {
            let full_deg_s = if full_mm_s == 1500.0 { 90.0 } else { 200.0 };
            RobotUri::Bcap { address: address.into(), network, full_mm_s, full_deg_s }
        };
        assert_eq!(read("bcap://10.0.0.2").unwrap(), bcap("10.0.0.2:5007", Network::Tcp, 1000.0));
        assert_eq!(
            read("bcap://rc8:6000/?network=udp&full=1500&turn=90").unwrap(),
            bcap("rc8:6000", Network::Udp, 1500.0)
        );
        assert_eq!(read("bcap://[::1]").unwrap(), bcap("[::1]:5007", Network::Tcp, 1000.0));
        assert_eq!(read("file:a/poses.json").unwrap(), RobotUri::File("a/poses.json".into()));
        for (uri, says) in [
            ("10.0.0.2", "not a robot's address"),
            ("http://rc8", "unknown robot link"),
            ("bcap://", "no host"),
            ("bcap://rc8:70000", "not a port"),
            ("bcap://rc8?speed=3", "speed=3"),
            ("bcap://rc8?full=nan", "full=nan"),
            ("bcap://rc8?turn=5", "turn=5"),
            ("file:", "no file"),
        ] {
            assert!(read(uri).unwrap_err().what.contains(says), "{uri}");
        }
    }

    #[test]
    fn the_document_states_the_full_speeds() {
        let says = format!("in mm/s (default {FULL_MM_S}) and degrees/s (default {FULL_DEG_S})");
        let document = include_str!("../../docs/robots.md").split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(document.contains(&says), "{says}");
    }
}
