//! In: the numbers of pictures as they come, incomplete ones, outages. Out: an account in which every picture that
//! the camera sent stands under its own name.
//! Frame and unit: pictures.

use super::clock::now_ns;
use super::metrics::Metrics;

/// What became of every picture that the camera says it sent.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Account {
    /// What the camera says it sent, or took: by its own counter, or by its numbers. With what an outage is reckoned
    /// to have cost.
    pub sent: u64,
    /// Came whole and in order.
    pub complete: u64,
    /// Came in part: packets were lost and did not come again. No picture.
    pub incomplete: u64,
    /// Never came: the camera, the cable or the network lost them.
    pub missed: u64,
    /// Came whole after a later one: order is kept, they are left out.
    pub late: u64,
    /// Packets that were asked for again and came; no pictures.
    pub resent: u64,
    /// Complete, and the memory for waiting pictures was full.
    pub dropped_queue: u64,
    /// Complete, and the disk was full or too slow.
    pub dropped_disk: u64,
    /// Complete, and passed over for a newer one or because processing was too slow.
    pub dropped_processing: u64,
    /// Complete, and nobody knows where what moves stood: left out and listed.
    pub unpaired: u64,
    /// Complete, and handed on: recorded, scanned or shown.
    pub used: u64,
    /// How often the camera was gone and came back.
    pub outages: u64,
}

impl Account {
    /// Pictures of which nobody says what became of them: 0, or the program is wrong.
    pub fn unexplained(&self) -> i64 {
        let [sent, arrived] = [self.sent, self.complete + self.incomplete + self.missed + self.late].map(|n| n as i64);
        let after = self.dropped_queue + self.dropped_disk + self.dropped_processing + self.unpaired + self.used;
        (sent - arrived).abs() + (self.complete as i64 - after as i64).abs()
    }

    /// All pictures that were dropped after they had come.
    pub fn dropped(&self) -> u64 {
        self.dropped_queue + self.dropped_disk + self.dropped_processing
    }

    /// Names and numbers, in order.
    fn rows(&self) -> [(&'static str, u64); 12] {
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
            ("used", self.used),
            ("outages", self.outages),
        ]
    }

    /// As Prometheus reads it.
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
    /// What is not 0, in one line.
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
    /// Host time of the last picture, and the usual time between two by their numbers, ns.
    last_ns: Option<u64>,
    period_ns: Option<f64>,
    /// Pictures of a while ago, number and host time, that the usual time is reckoned from.
    since: [Option<(u64, u64)>; 2],
    /// The camera was gone since the last picture; the number that was expected when it went.
    gone: bool,
    before: Option<u64>,
}

/// The rate is that of one to two such times, ns.
const WHILE: u64 = 10_000_000_000;

/// What the number of a picture says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// It is the next one, or some before it are missing.
    Next,
    /// A later one was here before.
    Late,
}

impl Ledger {
    /// A whole picture came.
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

    /// Part of a picture came.
    pub fn came_in_part(&mut self, id: u64) {
        self.back(id, now_ns());
        self.step(id);
        self.account.incomplete += 1;
    }

    /// Counts the numbers that were left out before this one; one that was counted as missed is so no more.
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

    /// The camera is gone; its numbers may begin anew when it is back.
    pub fn gone(&mut self) {
        self.before = self.expected.take().or(self.before);
        self.since = [None; 2];
        self.gone = true;
        self.since_open = 0;
    }

    /// Nothing comes any more; a camera that is still gone is missed to the end.
    pub fn ended(&mut self, host_ns: u64) {
        if let (true, Some(last), Some(period)) = (std::mem::take(&mut self.gone), self.last_ns, self.period_ns) {
            let missed = (host_ns.saturating_sub(last) as f64 / period).round() as u64;
            self.account.outages += 1;
            self.account.missed += missed;
            self.account.sent += missed;
        }
    }

    /// What an outage cost: the numbers in between where the device counted on, else the time since the last picture
    /// at the usual rate.
    fn back(&mut self, id: u64, host_ns: u64) {
        if !std::mem::take(&mut self.gone) {
            return;
        }
        self.account.outages += 1;
        let (Some(last), Some(period), Some(before)) = (self.last_ns, self.period_ns, self.before.take()) else {
            return;
        };
        let by_time = ((host_ns.saturating_sub(last) as f64 / period).round() as u64).saturating_sub(1);
        // Numbers that began anew are smaller, or far from what the time says.
        let missed = match id.checked_sub(before) {
            Some(by_number) if by_number.abs_diff(by_time) <= 2 + by_time / 4 => by_number,
            _ => by_time,
        };
        self.account.missed += missed;
        self.account.sent += missed;
        self.last_ns = None;
    }

    /// Arrivals come in bursts on a busy machine; over many pictures they tell the rate all the same.
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

    /// What the camera itself says it has sent since it was opened: those it sent and nobody saw are missed.
    pub fn says(&mut self, sent: u64) {
        let unseen = sent.saturating_sub(self.since_open);
        self.account.missed += unseen;
        self.account.sent += unseen;
        self.since_open += unseen;
    }

    /// Pictures a second, as they came lately.
    pub fn rate_hz(&self) -> Option<f64> {
        self.period_ns.filter(|p| *p > 0.0).map(|p| 1e9 / p)
    }

    /// The account so far, to be read and added to.
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
        // 5..=16: 5 6 9 12 whole, 8 late, 11 and 13 in part; 7, 10, 14, 15, 16 never came.
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
        // 10 s at 50 a second, then its numbers begin at 1 again.
        assert_eq!(ledger.came(1, 49 * 20 * ms + 10_000 * ms), Order::Next);
        let a = ledger.account();
        a.used = a.complete;
        assert_eq!((a.complete, a.missed, a.outages, a.sent), (51, 499, 1, 550));
        assert_eq!(a.unexplained(), 0);
    }

    /// The first ones wait somewhere and come at once: the rate is that of all.
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

    /// Back so soon that the time says nothing was lost, while the numbers say that one was.
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
