//! In: nothing, or a word. Out: the GigE Vision cameras that answer, or the one that the word names.
//! Frame and unit: none.

use crate::fault::{Fault, Result};
use std::net::Ipv4Addr;
use std::time::Duration;
use viva_genicam::blocking;
use viva_genicam::gige::{DeviceInfo, DiscoveryOptions};

/// Time to wait for answers.
const PATIENCE: Duration = Duration::from_millis(600);

/// A camera that answered.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Found {
    /// Its present address.
    pub ip: String,
    /// Empty if not stated.
    pub manufacturer: String,
    /// Empty if not stated.
    pub model: String,
    /// Empty if not stated.
    pub serial: String,
    /// The name that the user gave it.
    pub name: String,
    /// The address of this machine's interface on which it answered.
    pub interface: String,
}

impl Found {
    fn of(d: &DeviceInfo) -> Found {
        let word = |w: &Option<String>| w.clone().unwrap_or_default();
        Found {
            ip: d.ip.to_string(),
            manufacturer: word(&d.manufacturer),
            model: word(&d.model),
            serial: word(&d.serial),
            name: word(&d.user_name),
            interface: d.local_ip.map_or(String::new(), |ip| ip.to_string()),
        }
    }
}

fn devices() -> Result<Vec<DeviceInfo>> {
    let found = blocking::discover_with(PATIENCE, &DiscoveryOptions::new().include_loopback(true));
    found.map_err(|e| {
        Fault::input(format!("cameras cannot be searched for: {e}"))
            .cause("no network interface is up, or the program may not send broadcasts")
            .next("bring the camera's interface up, or name the camera by its address: gige://192.168.1.20")
    })
}

/// All cameras that answer on any interface, including this machine's loopback.
///
/// # Errors
/// No interface can be queried.
pub fn found() -> Result<Vec<Found>> {
    Ok(devices()?.iter().map(Found::of).collect())
}

/// The camera of that address, serial number or name; `first` means the only one that answers.
///
/// # Errors
/// None answers, or several do.
pub fn find(word: &str) -> Result<DeviceInfo> {
    let none = |asked: String| {
        Fault::input(format!("no camera found: {asked}"))
            .cause(
                "it has no power or no cable, its address is of another network, or a firewall drops UDP (port \
                    3956 and the stream's)",
            )
            .next(
                "list the cameras with: sheetlight camera list; let UDP from the camera through, and give both \
                   ends addresses of one network",
            )
    };
    if let Ok(ip) = word.parse::<Ipv4Addr>() {
        let answered = blocking::discover_ip(ip, PATIENCE);
        return answered.ok().flatten().ok_or_else(|| none(format!("{ip} does not answer within {PATIENCE:?}")));
    }
    let mut all = devices()?;
    let known: Vec<String> =
        all.iter().map(|d| format!("{} ({})", d.serial.clone().unwrap_or_default(), d.ip)).collect();
    if word != "first" {
        all.retain(|d| [&d.serial, &d.user_name].into_iter().flatten().any(|w| w == word));
    }
    match all.len() {
        1 => Ok(all.remove(0)),
        0 if known.is_empty() => {
            Err(none(format!("nobody answered a broadcast on {} within {PATIENCE:?}", interfaces())))
        }
        0 => Err(none(format!("nobody is called '{word}'; these answered: {}", known.join(", ")))),
        n => Err(Fault::usage(format!("'{word}' means {n} cameras: {}", known.join(", ")))
            .next("name one by its serial number or address")),
    }
}

/// Names of the interfaces that are queried, as far as the system lists them.
pub fn interfaces() -> String {
    let names = std::fs::read_dir("/sys/class/net")
        .map_or(Vec::new(), |all| all.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect());
    if names.is_empty() { "all interfaces".into() } else { names.join(", ") }
}
