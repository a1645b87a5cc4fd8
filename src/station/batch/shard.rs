//! In: i/n as typed. Out: which recordings of a manifest a process scans.
//! Frame and unit: counted from 1.

/// One of n shares of a manifest: every n-th recording, from the i-th on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    number: u64,
    of: u64,
}

impl Shard {
    /// All of a manifest.
    pub const WHOLE: Shard = Shard { number: 1, of: 1 };

    /// Whether it has the recording that stands at `place`, counted from 0.
    pub fn has(self, place: u64) -> bool {
        place % self.of == self.number - 1
    }
}

impl std::str::FromStr for Shard {
    type Err = String;
    fn from_str(s: &str) -> Result<Shard, String> {
        let read = s.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match read {
            Some((number, of)) if (1..=of).contains(&number) => Ok(Shard { number, of }),
            Some((number, of)) => Err(format!("shard {number} of {of}: the first is 1, the last {of}")),
            None => Err("wanted i/n, e.g. 3/8 for the third of eight shares".into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_recording_is_in_one_shard() {
        let shards: Vec<Shard> = (1..=3).map(|i| format!("{i}/3").parse().unwrap()).collect();
        assert!((0..10).all(|k| shards.iter().filter(|s| s.has(k)).count() == 1));
        assert!((0..10).all(|k| Shard::WHOLE.has(k)));
        assert_eq!("4/3".parse::<Shard>(), Err("shard 4 of 3: the first is 1, the last 3".into()));
        assert!("0/3".parse::<Shard>().is_err() && "0/0".parse::<Shard>().is_err() && "3".parse::<Shard>().is_err());
    }
}
