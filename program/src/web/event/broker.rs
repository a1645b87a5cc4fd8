//! In: an MQTT broker's address, login and certificate, as a person gives them. Out: where, as whom and in which form
//! the station publishes.
//! Frame and unit: none.

use super::Names;
use rumqttc::{LastWill, MqttOptions, TlsConfiguration, Transport};
use sheetlight::fault::{Fault, Result};
use std::time::Duration;

/// The broker is asked whether it is still there after this much silence.
const KEEP_ALIVE: Duration = Duration::from_secs(10);
const PLAIN_PORT: u16 = 1883;
const TLS_PORT: u16 = 8883;
/// Longest packet that is read, bytes. A longer one ends the connection.
const LONGEST_READ: usize = 4 << 20;
/// Longest packet that MQTT has. The client library's own limit, 10 KiB, is less than the result of a job may have.
const LONGEST_SENT: usize = (256 << 20) - 1;

/// A broker, and the topic below which everything is published.
#[derive(Clone)]
pub struct Broker {
    host: String,
    port: u16,
    /// Encrypted: with the certificate authority in this PEM text, or with those of the system.
    tls: Option<Option<Vec<u8>>>,
    login: Option<(String, String)>,
    topic: String,
    /// Published as a node of Sparkplug B instead of below the topic.
    names: Option<Names>,
}

impl std::fmt::Debug for Broker {
    /// Without the login.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.name(), self.topic)
    }
}

fn refused(what: impl Into<String>) -> Fault {
    Fault::usage(what).next("an address is mqtt://HOST, mqtt://HOST:1883 or mqtts://HOST:8883")
}

impl Broker {
    /// `uri`: `mqtt://HOST[:PORT]`, or `mqtts://HOST[:PORT]` with TLS. `topic`: the first levels of all topics.
    /// `login`: name and password, on two lines. `authority`: PEM certificates that sign the broker's.
    ///
    /// # Errors
    /// Another form of address; a topic with wildcards; a login that would cross the network in clear.
    pub fn new(uri: &str, topic: &str, login: Option<&str>, authority: Option<&[u8]>) -> Result<Broker> {
        let (scheme, rest) = uri.split_once("://").unwrap_or(("", uri));
        let encrypted = match scheme {
            "mqtt" => false,
            "mqtts" => true,
            _ => return Err(refused(format!("{uri}: not the address of an MQTT broker"))),
        };
        if rest.contains(['@', '/', '?', '#']) {
            return Err(refused(format!("{scheme}:// is followed by more than a host and a port"))
                .cause("a name, a password or a path stands in the address")
                .next("give the login as --mqtt-login FILE and the topic as --mqtt-topic"));
        }
        let (host, port) = match rest.rsplit_once(':') {
            // An IPv6 address in brackets has colons of its own.
            Some((host, port)) if !port.ends_with(']') => {
                let port = port.parse().ok().filter(|p| *p > 0);
                (host, port.ok_or_else(|| refused(format!("{uri}: the port is no number from 1 to 65535")))?)
            }
            _ => (rest, if encrypted { TLS_PORT } else { PLAIN_PORT }),
        };
        let host = host.trim_start_matches('[').trim_end_matches(']');
        if host.is_empty() {
            return Err(refused(format!("{uri}: no host")));
        }
        let levels = topic.split('/').all(|level| !level.is_empty());
        if !levels || topic.starts_with('$') || topic.contains(['+', '#']) || topic.chars().any(char::is_control) {
            return Err(Fault::usage(format!("topic '{topic}' has an empty level, + or #, or begins with $"))
                .cause("brokers keep these characters for subscriptions and for themselves")
                .next("name a topic such as sheetlight/cell3 with --mqtt-topic"));
        }
        if authority.is_some() && !encrypted {
            return Err(refused("a certificate authority is given, and mqtt:// is not encrypted"));
        }
        let login = login.map(two_lines).transpose()?;
        let here = host == "localhost" || host.parse::<std::net::IpAddr>().is_ok_and(|ip| ip.is_loopback());
        if login.is_some() && !encrypted && !here {
            return Err(refused(format!("{uri}: the password would cross the network in clear"))
                .cause("mqtt:// is not encrypted")
                .next("use mqtts://, with --mqtt-ca FILE if the plant signs its own certificates"));
        }
        let tls = encrypted.then(|| authority.map(<[u8]>::to_vec));
        Ok(Broker { host: host.to_owned(), port, tls, login, topic: topic.to_owned(), names: None })
    }

    /// The same broker, at which the station is a node of Sparkplug B.
    pub fn as_node(self, names: Names) -> Broker {
        Broker { names: Some(names), ..self }
    }

    /// The node of Sparkplug B, if the station is one.
    pub fn names(&self) -> Option<&Names> {
        self.names.as_ref()
    }

    /// The broker's address, for messages.
    pub fn name(&self) -> String {
        let scheme = if self.tls.is_some() { "mqtts" } else { "mqtt" };
        let host = if self.host.contains(':') { format!("[{}]", self.host) } else { self.host.clone() };
        format!("{scheme}://{host}:{}", self.port)
    }

    /// A topic of this station.
    pub(super) fn topic(&self, of: &str) -> String {
        format!("{}/{of}", self.topic)
    }

    /// How to connect, by a name of the connection. If it is lost, the broker itself publishes the will.
    pub(super) fn options(&self, client: String, will: LastWill) -> MqttOptions {
        let mut options = MqttOptions::new(client, &self.host, self.port);
        options.set_keep_alive(KEEP_ALIVE);
        options.set_last_will(will).set_max_packet_size(LONGEST_READ, LONGEST_SENT);
        if let Some((name, password)) = &self.login {
            options.set_credentials(name, password);
        }
        if let Some(authority) = &self.tls {
            let simple = |ca: &Vec<u8>| TlsConfiguration::Simple { ca: ca.clone(), alpn: None, client_auth: None };
            options.set_transport(Transport::tls_with_config(authority.as_ref().map_or_else(Default::default, simple)));
        }
        options
    }
}

/// A login: the name on the first line, the password on the second.
fn two_lines(text: &str) -> Result<(String, String)> {
    let mut lines = text.lines();
    match (lines.next(), lines.next(), lines.next()) {
        (Some(name), Some(password), None) if !name.is_empty() => Ok((name.to_owned(), password.to_owned())),
        _ => Err(Fault::usage("the file of --mqtt-login does not hold two lines")
            .next("write the name on the first line and the password on the second")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_taken_whole_or_refused() {
        let name = |uri: &str| Broker::new(uri, "a/b", None, None).map(|b| b.name());
        assert_eq!(name("mqtt://broker").unwrap(), "mqtt://broker:1883");
        assert_eq!(name("mqtts://broker").unwrap(), "mqtts://broker:8883");
        assert_eq!(name("mqtt://10.0.0.7:99").unwrap(), "mqtt://10.0.0.7:99");
        assert_eq!(name("mqtt://[::1]:99").unwrap(), "mqtt://[::1]:99");
        assert_eq!(name("mqtt://[::1]").unwrap(), "mqtt://[::1]:1883");
        for wrong in ["broker", "http://broker", "mqtt://", "mqtt://a:0", "mqtt://a:x", "mqtt://u:p@a", "mqtt://a/b"] {
            assert!(!name(wrong).unwrap_err().next.is_empty(), "{wrong}");
        }
        for topic in ["", "/a", "a//b", "a/", "a/#", "+", "$SYS/a", "a\nb"] {
            assert!(Broker::new("mqtt://a", topic, None, None).is_err(), "{topic:?}");
        }
    }

    #[test]
    fn a_password_does_not_cross_the_network_in_clear() {
        let login = Some("me\nsecret\n");
        assert!(Broker::new("mqtt://10.0.0.7", "a", login, None).unwrap_err().what.contains("in clear"));
        for allowed in ["mqtts://10.0.0.7", "mqtt://127.0.0.1", "mqtt://localhost"] {
            let broker = Broker::new(allowed, "a", login, None).unwrap();
            assert!(!format!("{broker:?}").contains("secret"));
        }
        assert!(Broker::new("mqtt://localhost", "a", Some("one line"), None).is_err());
        assert!(Broker::new("mqtt://localhost", "a", None, Some(b"PEM")).is_err());
    }
}
