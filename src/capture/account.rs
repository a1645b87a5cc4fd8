//! In: the numbers of pictures as they arrive, incomplete ones, outages. Out: an account that assigns every picture
//! that the camera sent to one class.
//! Frame and unit: pictures.

use super::clock::now_ns;
use super::metrics::Metrics;

/// What became of every picture that the camera reports to have sent.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Account {
    /// Pictures that the camera reports to have sent or taken, by its own counter or by its numbers. The estimated
    /// losses of outages are included.
    pub sent: u64,
    /// Arrived complete and in order.
    pub complete: u64,
    /// Arrived in part: packets were lost and not received again. Such a picture is not used.
    pub incomplete: u64,
    /// Never arrived: lost by the camera, the cable or the network.
    pub missed: u64,
    /// Arrived complete after a later one; excluded to keep the order.
    pub late: u64,
    /// Packets that were requested again and arrived; not a number of pictures.
    pub resent: u64,
    /// Complete, but the memory for waiting pictures was full.
    pub dropped_queue: u64,
    /// Complete, but the disk was full or too slow.
    pub dropped_disk: u64,
    /// Complete, but skipped for a newer one, or because processing was too slow.
    pub dropped_processing: u64,
    /// Complete, but the position of what moves is unknown; excluded and listed.
    pub unpaired: u64,
    /// Complete, but not needed: exposed before a setting took effect, or one more of a pose whose exposures are
    /// recorded.
    #[serde(default)]
    pub spare: u64,
    /// Complete and delivered: recorded, scanned or shown.
    pub used: u64,
    /// Number of times that the camera was lost and came back.
    pub outages: u64,
}

impl Account {
    /// Pictures that no class explains: anything but 0 is an error of the program.
    pub fn unexplained(&self) -> i64 {
        let [sent, arrived] = [self.sent, self.complete + self.incomplete + self.missed + self.late].map(|n| n as i64);
        let after =
            self.dropped_queue + self.dropped_disk + self.dropped_processing + self.unpaired + self.spare + self.used;
        (sent - arrived).abs() + (self.complete as i64 - after as i64).abs()
    }

    /// All pictures that were dropped after they had arrived.
    pub fn dropped(&self) -> u64 {
        self.dropped_queue + self.dropped_disk + self.dropped_processing
    }

    /// Names and numbers, in order.
    fn rows(&self) -> [(&'static str, u64); 13] {
        [
            ("sent", self.sent),
            ("complete", self.complete),
            ("incomplete", self.incomplete),
            ("missed", self.missed),
            ("late", self.late),
            ("resent", self.resent),
            ("dropped_queue", self.dropped_queue),
            ("dropped_disk", self.dropped_disk),
            ("dropped_processing", self.dropped_processing),
            ("unpaired", self.unpaired),
            ("spare", self.spare),
            ("used", self.used),
            ("outages", self.outages),
        ]
    }

    /// The account in Prometheus' text format.
    pub fn prometheus(&self, camera: &str) -> String {
        let mut metrics = Metrics::default();
        self.count(camera, &mut metrics);
        metrics.text()
    }

    /// Adds the pictures of a camera to what Prometheus reads.
    pub fn count(&self, camera: &str, metrics: &mut Metrics) {
        let help = "Pictures of a camera by what became of them.";
        let rows = self.rows();
        let figures = rows.iter().map(|(result, n)| (vec![("camera", camera), ("result", *result)], *n));
        metrics.family(("sheetlight_frames_total", "counter"), help, figures);
    }
}

impl std::fmt::Display for Account {
    /// All numbers that are not 0, in one line.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let rows = self.rows();
        let shown = rows.iter().filter(|(name, n)| *n > 0 || matches!(*name, "sent" | "used"));
        let words: Vec<String> = shown.map(|(name, n)| format!("{n} {}", name.replace('_', " by "))).collect();
        f.write_str(&words.join(", "))
    }
}

/// Follows the numbers of a camera's pictures.
#[derive(Debug, Default)]
pub struct Ledger {
    account: Account,
    /// The number that the next picture should have; none before the first, and after an outage.
    expected: Option<u64>,
    /// Accounted for since the camera was opened.
    since_open: u64,
    /// Host time of the last picture, ns, and the usual time between two consecutive numbers, ns.
    last_ns: Option<u64>,
    period_ns: Option<f64>,
    /// Earlier pictures (number and host time) from which the usual time is computed.
    since: [Option<(u64, u64)>; 2],
    /// Whether the camera was lost since the last picture; and the number that was expected when it was lost.
    gone: bool,
    before: Option<u64>,
}

/// The rate is measured over one to two times this duration, ns.
const WHILE: u64 = 10_000_000_000;

/// What the number of a picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// It is the next one; some before it may be missing.
    Next,
    /// A later one arrived before it.
    Late,
}

impl Ledger {
    /// A complete picture arrived.
    pub fn came(&mut self, id: u64, host_ns: u64) -> Order {
        self.back(id, host_ns);
        self.follow(id, host_ns);
        let order = self.step(id);
        match order {
            Order::Next => self.account.complete += 1,
            Order::Late => self.account.late += 1,
        }
        order
    }

    /// An incomplete picture arrived.
    pub fn came_in_part(&mut self, id: u64) {
        self.back(id, now_ns());
        self.step(id);
        self.account.incomplete += 1;
    }

    /// Counts the numbers missing before this one as missed. A number that arrives after it was counted as missed is
    /// removed from that count.
    fn step(&mut self, id: u64) -> Order {
        let expected = self.expected.unwrap_or(id);
        if id < expected {
            if self.account.missed > 0 {
                self.account.missed -= 1;
            } else {
                self.since_open += 1;
                self.account.sent += 1;
            }
            return Order::Late;
        }
        let new = (id - expected).saturating_add(1);
        for count in [&mut self.account.sent, &mut self.since_open] {
            *count = count.saturating_add(new);
        }
        self.account.missed = self.account.missed.saturating_add(new - 1);
        self.expected = Some(id.saturating_add(1));
        Order::Next
    }

    /// The camera is lost; its numbers may restart when it comes back.
    pub fn gone(&mut self) {
        self.before = self.expected.take().or(self.before);
        self.since = [None; 2];
        self.gone = true;
        self.since_open = 0;
    }

    /// Nothing arrives any more. For a camera that is still lost, pictures are counted as missed until now.
    pub fn ended(&mut self, host_ns: u64) {
        if let (true, Some(last), Some(period)) = (std::mem::take(&mut self.gone), self.last_ns, self.period_ns) {
            let missed = (host_ns.saturating_sub(last) as f64 / period).round() as u64;
            self.account.outages += 1;
            self.account.missed += missed;
            self.account.sent += missed;
        }
    }

    /// Adds the losses of an outage: the numbers in between if the device went on counting, else the time since the
    /// last picture at the usual rate.
    fn back(&mut self, id: u64, host_ns: u64) {
        if !std::mem::take(&mut self.gone) {
            return;
        }
        self.account.outages += 1;
        let (Some(last), Some(period), Some(before)) = (self.last_ns, self.period_ns, self.before.take()) else {
            return;
        };
        let by_time = ((host_ns.saturating_sub(last) as f64 / period).round() as u64).saturating_sub(1);
        // Numbers that restarted are smaller, or far from what the time suggests.
        let missed = match id.checked_sub(before) {
            Some(by_number) if by_number.abs_diff(by_time) <= 2 + by_time / 4 => by_number,
            _ => by_time,
        };
        self.account.missed += missed;
        self.account.sent += missed;
        self.last_ns = None;
    }

    /// On a busy machine pictures arrive in bursts, but over many pictures their arrivals still give the rate.
    fn follow(&mut self, id: u64, host_ns: u64) {
        self.last_ns = Some(host_ns);
        let (first, first_ns) = *self.since[0].get_or_insert((id, host_ns));
        let (_, later_ns) = *self.since[1].get_or_insert((id, host_ns));
        if id > first && host_ns > first_ns {
            self.period_ns = Some((host_ns - first_ns) as f64 / (id - first) as f64);
        }
        if host_ns.saturating_sub(later_ns) > WHILE {
            self.since = [self.since[1], Some((id, host_ns))];
        }
    }

    /// Takes the number of pictures that the camera reports to have sent since it was opened. Those that were never
    /// seen count as missed.
    pub fn says(&mut self, sent: u64) {
        let unseen = sent.saturating_sub(self.since_open);
        self.account.missed += unseen;
        self.account.sent += unseen;
        self.since_open += unseen;
    }

    /// Recent rate of pictures, per second.
    pub fn rate_hz(&self) -> Option<f64> {
        self.period_ns.filter(|p| *p > 0.0).map(|p| 1e9 / p)
    }

    /// The account so far, for reading and for adding to it.
    pub fn account(&mut self) -> &mut Account {
        &mut self.account
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_is_accounted_for() {
        let mut ledger = Ledger::default();
        let orders: Vec<Order> = [5, 6, 9, 8, 12].iter().map(|id| ledger.came(*id, 1000 * id)).collect();
        assert_eq!(orders, [Order::Next, Order::Next, Order::Next, Order::Late, Order::Next]);
        ledger.came_in_part(11);
        ledger.came_in_part(13);
        ledger.says(12);
        let a = ledger.account();
        a.used = a.complete;
        // Numbers 5..=16: 5 6 9 12 complete, 8 late, 11 and 13 incomplete; 7, 10, 14, 15, 16 never arrived.
        assert_eq!((a.sent, a.complete, a.late, a.incomplete, a.missed), (12, 4, 1, 2, 5));
        assert_eq!(a.unexplained(), 0);
        a.used -= 1;
        assert_eq!(a.unexplained(), 1);
    }

    #[test]
    fn an_outage_costs_what_the_time_was_worth() {
        let mut ledger = Ledger::default();
        let ms = 1_000_000;
        (0..50).for_each(|i| assert_eq!(ledger.came(i, i * 20 * ms), Order::Next));
        ledger.gone();
        // 10 s at 50 a second, then the numbers restart at 1.
        assert_eq!(ledger.came(1, 49 * 20 * ms + 10_000 * ms), Order::Next);
        let a = ledger.account();
        a.used = a.complete;
        assert_eq!((a.complete, a.missed, a.outages, a.sent), (51, 499, 1, 550));
        assert_eq!(a.unexplained(), 0);
    }

    /// The first ones are held up and arrive together; the rate is that of all pictures.
    #[test]
    fn bursts_are_no_rate() {
        let mut ledger = Ledger::default();
        for i in 0..50u64 {
            ledger.came(i, 200_000_000.max(i * 25_000_000) + 100_000 * (i % 7));
        }
        ledger.gone();
        ledger.came(1, 49 * 25_000_000 + 10_000_000_000);
        let missed = ledger.account().missed;
        assert!((399..480).contains(&missed), "{missed}");
    }

    #[test]
    fn a_camera_that_does_not_come_back_is_missed_to_the_end() {
        let mut ledger = Ledger::default();
        (0..50).for_each(|i| assert_eq!(ledger.came(i, i * 20_000_000), Order::Next));
        ledger.gone();
        ledger.ended(49 * 20_000_000 + 2_000_000_000);
        ledger.ended(1 << 60);
        let a = ledger.account();
        a.used = a.complete;
        assert_eq!((a.missed, a.outages, a.sent, a.unexplained()), (100, 1, 150, 0));
    }

    /// The camera is back so soon that the time suggests no loss, while the numbers show one.
    #[test]
    fn a_device_that_counts_on_through_an_outage_is_believed() {
        let mut ledger = Ledger::default();
        (0..30).for_each(|i| assert_eq!(ledger.came(i, i * 10_000_000), Order::Next));
        ledger.gone();
        assert_eq!(ledger.came(31, 303_000_000), Order::Next);
        let a = ledger.account();
        a.used = a.complete;
        assert_eq!((a.complete, a.missed, a.outages, a.sent, a.unexplained()), (31, 1, 1, 32, 0));
    }
}
