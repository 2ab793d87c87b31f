//! Parts of the loop, as `study` and `timing` measure them: each works on the fields of the `Bench` that includes it.

use super::Bench;
use fingertip::contact;
use fingertip::grip::Goal;
use fingertip::units::Celsius;

pub extern "C" fn read(bench: &mut Bench) {
    bench.array.read(&bench.record.frame, bench.config);
}

pub extern "C" fn curved_read(bench: &mut Bench) {
    bench.array.read(&bench.record.frame, bench.corrected);
}

pub extern "C" fn observe(bench: &mut Bench) {
    bench.motion.observe(bench.record.sense.encoder, bench.config);
}

pub extern "C" fn reference(bench: &mut Bench) {
    let Bench { config, record, contact, touch, drift, motion, grip, limits, .. } = bench;
    let goal = Goal { force: record.command.goal, drift: *drift };
    bench.reference = images::reference(grip, goal, contact, touch, motion, config, limits);
}

pub extern "C" fn creeping(bench: &mut Bench) {
    let Bench { corrected, record, contact, touch, drift, motion, grip, limits, .. } = bench;
    let goal = Goal { force: record.command.goal, drift: *drift };
    bench.reference = images::reference(grip, goal, contact, touch, motion, corrected, limits);
}

pub extern "C" fn follow(bench: &mut Bench) {
    let supply_mv = bench.record.sense.supply_mv;
    bench.motion.apply_law(bench.reference, supply_mv, bench.config, &mut bench.limits);
}

pub extern "C" fn duty(bench: &mut Bench) {
    bench.duty = bench.motion.drive.duty(bench.record.sense.supply_mv, bench.config);
}

pub extern "C" fn winding(bench: &mut Bench) {
    bench.winding.observe(bench.motion.drive.acceleration(), bench.config);
}

pub extern "C" fn temperature_drift(bench: &mut Bench) {
    bench.temperature_drift.observe(Some(Celsius::from_bits(30 << 16)), bench.corrected);
    bench.drift = bench.temperature_drift.force(bench.record.command.goal, bench.corrected);
}

pub extern "C" fn sums(bench: &mut Bench) {
    bench.contact = contact::from_sums(&bench.picture, bench.config);
}
