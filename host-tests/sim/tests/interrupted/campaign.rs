//! Interruptions by the hundred: nothing that was whole is lost or changed, and what goes on ends as if nothing had
//! happened.

use crate::jobs::Job;
use crate::strike::{Kind, strike};
use fastrand::Rng;
use std::collections::BTreeMap;

#[test]
fn a_short_campaign_loses_nothing() {
    campaign("short", 1);
}

/// `cargo test -p sim --profile host --test interrupted -- --ignored --nocapture`
#[test]
#[ignore = "takes minutes"]
fn the_whole_campaign_loses_nothing() {
    campaign("whole", 24);
}

/// Strikes each job in each way so many times.
fn campaign(name: &str, times: usize) {
    let mut rng = Rng::with_seed(7);
    let mut tally: BTreeMap<(&str, Kind), usize> = BTreeMap::new();
    for job in Job::all(name) {
        for kind in Kind::ALL {
            let mut struck = 0;
            // A command that is done before it is struck does not count.
            for _ in 0..20 * times {
                if struck == times {
                    break;
                }
                struck += usize::from(once(&job, kind, &mut rng));
            }
            assert_eq!(struck, times, "{} could not be struck by {kind:?}", job.name);
            tally.insert((job.name, kind), struck);
        }
    }
    println!("{tally:#?}\n{} interruptions, nothing lost or changed", tally.values().sum::<usize>());
}

/// Strikes a job once, or a few times before it goes on.
fn once(job: &Job, kind: Kind, rng: &mut Rng) -> bool {
    let after = format!("{kind:?}");
    let mut at = rng.u64(1..job.bytes * 9 / 10);
    // Now and then within the lock and the first line.
    if rng.u8(..) < 40 {
        at = rng.u64(1..200);
    }
    let interrupted = strike(job, kind, at);
    let done = job.check_parts(&after);
    if interrupted && kind != Kind::TwoAtOnce && rng.bool() {
        // Struck again on its way: what was done by then stays.
        strike(job, Kind::CutWrite, rng.u64(1..job.bytes));
        let still = job.check_parts("a second strike");
        assert!(still >= done, "{}: {still} of {done} are left after {after} and a cut", job.name);
    }
    job.check_whole(&after);
    job.clear();
    interrupted
}
