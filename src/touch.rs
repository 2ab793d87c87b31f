//! The record of what the tip touches, from the first reading to the residue that a release leaves in the array.
//!
//! There is one record. Every frame updates it, whatever the finger does, so a change of mode cannot leave it behind:
//!
//! | stage | meaning | ends when |
//! | --- | --- | --- |
//! | none | the array shows no contact | the force reaches `contact_on_mn`: held |
//! | held | something is pressed | the force falls below `contact_off_mn`: lost, or doubtful; within 3 ms: none |
//! | lost | the force fell away; the surface stays known | a force returns: held; no object can be that deep: none |
//! | doubtful | the force vanished in a frame: the object is gone, or the array's signal | a force returns: held; a release has backed off: clear |
//! | clear | a release has backed off; what the array still reads is a residue of the contact | a larger reading for 1 ms: held; the next approach: none |
//!
//! A force cannot fall by a quarter within a frame: the object would have to leave at metres in a second. Such a step
//! is withheld: the loop continues with the force before it, and does not press harder. A step that takes back a step
//! up shows the force again. The guard deliberately keeps a separate record, from raw readings.

use crate::config::Config;
use crate::contact::Contact;
use crate::units::{Millimetres, Newtons};
use fixed::types::{I8F24, I16F16};

/// A force that falls by more than this part of itself, and `contact_on_mn`, in one frame did not fall at the tip: 1/4.
const STEP_BITS: u32 = 2;
/// Time after a step up within which a fall takes it back; one that stays for 8 ms is fault 2.
const ROSE_NS: u32 = 10_000_000;
/// Distance that a tip may move at rest while the array shows the same: 1/64 mm.
const AT_REST: I8F24 = I8F24::from_bits((1 << 24) / 64);
/// Longest frame time in which no object moves that far, ns.
pub const FRAME_NS_MAX: u32 = 500_000;
/// Time for which a force stays away before the touch is doubtful, or stays before it is no peak of noise, ns.
const DOUBTFUL_NS: u32 = 3_000_000;
/// Time for which a new force stays before it has a place, longer than a peak of noise on a residue, ns.
const PEAK_NS: u32 = 300_000;
/// Time for which a reading stays above a residue before something pushes the released tip, ns.
const PUSH_NS: u32 = 1_000_000;
/// Time after which a doubtful touch is given up, whether the tip could back off or not, ns.
const GIVEN_UP_NS: u32 = 500_000_000;
/// Largest uncertainty (`doubt`) at which the force of the fit is used: 1/8. Above it the plain sum is used as well.
pub const SURE: u8 = u8::MAX / 8;
/// Largest part of the held force that counts as a residue: 1/4.
const RESIDUE_BITS: u32 = 2;
/// Rounds of the baseline for which a residue is learnt; of ten rows 0.26 s.
const RESIDUE_ROUNDS: u32 = 256;
/// Weights of the baseline, Q16: following drift (10,240 frames of ten rows), and the first round after a contact.
const DRIFT_WEIGHT: u32 = 64;
const FIRST_ROUNDS: u32 = 4;
/// Frames that are counted at most.
const FRAMES_MAX: u32 = 1 << 16;

/// Life cycle of a touch, see the table above.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stage {
    /// No contact.
    #[default]
    None,
    /// Something is pressed.
    Held,
    /// The contact ended without a release.
    Lost,
    /// The force vanished at once.
    Doubtful,
    /// Released, and behind the surface.
    Clear,
}

/// Knowledge of the surface's place. A force that has not risen by `contact_on_mn` may be a residue of an earlier
/// contact, noise, or a faulty taxel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Place {
    /// The force has not risen yet. The surface is computed from the present travel and indentation.
    #[default]
    Here,
    /// The force returned and has not risen since. The surface is kept from the contact before.
    Before,
    /// The force has not risen since torque, a release or a press began. The surface is kept from before that.
    Inherited,
    /// The force rose: the surface is known.
    Known,
}

/// Record of what the tip touches.
#[derive(Clone, Copy, Debug, Default)]
pub struct Touch {
    stage: Stage,
    /// Rearmost travel at which the object was touched.
    surface: Millimetres,
    place: Place,
    /// Indentation by the motor when the array came to see the contact; 0 where the array saw it first.
    by_motor: Millimetres,
    /// Largest force of this touch.
    peak: Newtons,
    /// Least force of a touch without a place, or since the tip is clear.
    least: Newtons,
    /// Force that the array lost in a step, added to what it reads.
    withheld: Newtons,
    /// Force, sum and bad taxels of the last frame; the lesser force and sum of the last two frames: a frame that reads
    /// too much is no reference.
    before: (Newtons, Newtons, u8),
    lesser: (Newtons, Newtons),
    /// Lower estimate of the force: the plain sum where much of the contact may be hidden, else the force of the fit.
    /// The fit takes a faulty taxel at the array's edge for a contact many times larger.
    shown: Newtons,
    /// Number of frames since the force began, or since the tip is clear.
    frames: u32,
    /// Frames for which the force has been above its least by `contact_on_mn`, where the touch has no place yet or the tip
    /// is clear.
    risen: u32,
    /// Time without a force, ns.
    away_ns: u32,
    /// Frame of the last step up, and the force before it.
    rise: (u32, Newtons),
    /// Travel at the last frame whose sum differs from the one before.
    seen_at: Millimetres,
}

/// Inputs of the record in a frame.
pub struct TouchInputs<'a> {
    /// The contact by the array.
    pub contact: &'a Contact,
    /// Force by the plain sum of the taxels: a step in it is a step of the signal, not of the fit.
    pub summed: Newtons,
    /// Travel of the tip.
    pub travel: Millimetres,
    /// True except in a release, where the grip places the surface, not this record.
    pub presses: bool,
}

impl Touch {
    /// Takes a frame; `by_motor` returns the indentation by the force that the motor measured, and is called when a
    /// touch begins.
    #[inline(always)]
    pub fn observe(&mut self, inputs: &TouchInputs, by_motor: impl Fn() -> Millimetres, config: &Config) {
        let Contact { force, doubt, .. } = *inputs.contact;
        let shown = if doubt > SURE { force.min(inputs.summed) } else { force };
        self.shown = shown;
        match self.stage {
            Stage::Held => self.hold(inputs, config),
            Stage::None if force >= config.contact_on => self.begin(inputs, by_motor()),
            Stage::Lost if shown >= config.contact_on => self.begin(inputs, by_motor()),
            Stage::None => {}
            Stage::Lost => {
                // Nothing is pressed deeper than the largest force presses: the object left.
                if self.deep(inputs.travel) > config.bounds.back {
                    *self = Self { shown, ..Self::default() };
                }
            }
            Stage::Doubtful if self.away_ns > GIVEN_UP_NS => *self = Self { shown, ..Self::default() },
            Stage::Doubtful | Stage::Clear => {
                self.away_ns = self.away_ns.saturating_add(config.timing.frame_ns);
                self.least = self.least.min(shown);
                self.frames = (self.frames + 1).min(FRAMES_MAX);
                // Peaks of noise on a residue are shorter.
                let long_ns = if self.stage == Stage::Clear { PUSH_NS } else { 0 };
                if self.rises(long_ns, config) {
                    self.begin(inputs, by_motor());
                }
            }
        }
        if inputs.summed != self.before.1 {
            self.seen_at = inputs.travel;
        }
        self.lesser = (force.min(self.before.0), inputs.summed.min(self.before.1));
        self.before = (force, inputs.summed, inputs.contact.bad_taxels);
    }

    /// Starts a touch. A force that returns keeps the surface and the largest force of the contact before, until it
    /// rises.
    fn begin(&mut self, inputs: &TouchInputs, by_motor: Millimetres) {
        let force = inputs.contact.force;
        let kept = self.stage != Stage::None && self.place != Place::Here;
        let (place, surface, peak) =
            if kept { (Place::Before, self.surface, self.peak) } else { (Place::Here, place(inputs, by_motor), force) };
        let shown = self.shown;
        *self = Self { stage: Stage::Held, place, surface, by_motor, peak, least: shown, shown, ..Self::default() };
    }

    fn hold(&mut self, inputs: &TouchInputs, config: &Config) {
        let Contact { force, .. } = *inputs.contact;
        let (force_before, Newtons(sum_before)) = self.lesser;
        let step = force_before.0.saturating_sub(force.0);
        let fell = sum_before.saturating_sub(inputs.summed.0);
        let least = (sum_before >> STEP_BITS).saturating_add(config.contact_on.0);
        // Taxels that fail take their share of the sum with them; in a slow frame an object can leave.
        let comparable = || self.before.2 == inputs.contact.bad_taxels && config.timing.frame_ns <= FRAME_NS_MAX;
        if fell.to_bits().unsigned_abs() > least.to_bits().cast_unsigned() && comparable() {
            self.note_step(step, fell > 0, least, force, config);
        } else if self.withheld > Newtons::ZERO && step.saturating_neg() > self.withheld.0 >> 1 {
            // The signal is back.
            self.withheld = Newtons::ZERO;
        }
        self.peak = self.peak.max(force);
        self.frames = (self.frames + 1).min(FRAMES_MAX);
        if self.place != Place::Known && self.withheld == Newtons::ZERO {
            self.least = self.least.min(self.shown);
            self.find(inputs, config);
        }
        // After a step, what hysteresis and creep leave is no force.
        let residue = self.withheld > Newtons::ZERO && force.0 <= self.peak.0 >> RESIDUE_BITS;
        if force >= config.contact_off && !residue {
            self.away_ns = 0;
        } else if self.fleeting(config) {
            *self = Self { shown: self.shown, ..Self::default() };
        } else if self.withheld == Newtons::ZERO {
            self.stage = Stage::Lost;
        } else {
            self.away_ns = self.away_ns.saturating_add(config.timing.frame_ns);
            if self.away_ns > DOUBTFUL_NS {
                (self.stage, self.least, self.risen) = (Stage::Doubtful, force, 0);
            }
        }
    }

    /// Takes a step of the signal, by at least `least` in the sum. A fall soon after a rise takes it back, if it ends within
    /// half of the force before that.
    #[cold]
    #[inline(never)]
    fn note_step(&mut self, step: I16F16, fell: bool, least: I16F16, force: Newtons, config: &Config) {
        let (force_before, Newtons(sum_before)) = self.lesser;
        if !fell {
            if step.saturating_neg() > self.withheld.0 >> 1 {
                self.withheld = Newtons::ZERO;
            }
            // One frame that reads too much is no rise. The time is counted on from here.
            if self.before.1.0.saturating_sub(sum_before) > least {
                self.frames = self.frames.min(FRAMES_MAX / 2);
                self.rise = (self.frames, force_before);
            }
            return;
        }
        let (at, Newtons(before)) = core::mem::take(&mut self.rise);
        let soon = self.frames.saturating_sub(at).saturating_mul(config.timing.frame_ns) <= ROSE_NS;
        let off = force.0.saturating_sub(before).saturating_abs();
        if before == I16F16::ZERO || !soon || off > before >> 1 {
            self.withheld = Newtons(self.withheld.0.saturating_add(step)).max(Newtons::from_bits(1));
            // The object may have moved towards the finger since it was touched, and is where the array last showed it. What
            // a step up added is no force.
            let pressed = if before == I16F16::ZERO { force_before } else { force_before.min(Newtons(before)) };
            let deep = config.tip.indentation(pressed);
            self.surface = self.surface.min(Millimetres(self.seen_at.0.saturating_sub(deep.0)));
        }
    }

    /// Counts a frame. Returns true once the force has been above its least by `contact_on_mn` for longer than this.
    #[inline(always)]
    fn rises(&mut self, long_ns: u32, config: &Config) -> bool {
        let above = self.shown.0 > self.least.0.saturating_add(config.contact_on.0);
        self.risen = if above { (self.risen + 1).min(FRAMES_MAX) } else { 0 };
        self.risen.saturating_mul(config.timing.frame_ns) > long_ns
    }

    /// Looks for the surface's place.
    fn find(&mut self, inputs: &TouchInputs, config: &Config) {
        let long_ns = if self.place == Place::Here { PEAK_NS } else { DOUBTFUL_NS };
        let rises = self.rises(long_ns, config) && (inputs.presses || self.place != Place::Before);
        let here = place(inputs, self.by_motor);
        let sure = inputs.contact.doubt == 0;
        match self.place {
            // If a part of the contact is hidden, an indentation that is too small must not move the surface.
            Place::Here if sure => self.surface = self.surface.max(here),
            Place::Before if rises => {
                // A contact that was lost to the array alone is where it was.
                self.surface = if sure { here } else { here.min(self.surface) };
                self.peak = inputs.contact.force;
            }
            _ => {}
        }
        if rises {
            self.place = Place::Known;
        }
    }

    /// Stage of the life cycle.
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// Returns true if something is pressed.
    pub fn held(&self) -> bool {
        self.stage == Stage::Held
    }

    /// Travel at which the object was touched; none where nothing is known of one.
    pub fn surface(&self) -> Option<Millimetres> {
        (self.stage != Stage::None).then_some(self.surface)
    }

    /// True if the force rose by `contact_on_mn` since the touch, torque, a release or a press began, or it returned.
    pub fn placed(&self) -> bool {
        self.place == Place::Known
    }

    /// True if the contact lasts longer than a peak of noise: 3 ms.
    pub fn lasts(&self, config: &Config) -> bool {
        self.held() && self.frames.saturating_mul(config.timing.frame_ns) > DOUBTFUL_NS
    }

    /// True if a new contact is so far no longer than a peak of noise: nothing follows from its place.
    pub fn fleeting(&self, config: &Config) -> bool {
        self.held() && self.place == Place::Here && !self.lasts(config)
    }

    /// True if the force returned and has not risen since: the surface is still that of the contact before.
    pub fn returns(&self) -> bool {
        self.place == Place::Before && self.held()
    }

    /// Lower estimate of the force, see the field.
    pub fn shown(&self) -> Newtons {
        self.shown
    }

    /// Distance of the tip beyond the surface, into the object.
    pub fn deep(&self, travel: Millimetres) -> Millimetres {
        Millimetres(travel.0.saturating_sub(self.surface.0))
    }

    /// Distance that the tip moved into a known object since the array last showed anything new, beyond what a tip at rest
    /// may move.
    pub fn since_new_image(&self, travel: Millimetres) -> Millimetres {
        let moved = travel.0.saturating_sub(self.seen_at.0).saturating_sub(AT_REST).max(I8F24::ZERO);
        if self.placed() { Millimetres(moved) } else { Millimetres::ZERO }
    }

    /// Indentation by the motor when the touch began.
    pub fn by_motor(&self) -> Millimetres {
        self.by_motor
    }

    /// Largest force of this touch.
    pub fn peak(&self) -> Newtons {
        self.peak
    }

    /// Force that the array lost in a step.
    pub fn withheld(&self) -> Newtons {
        self.withheld
    }

    /// Moves the surface back: the object is pressed farther back than it was touched, because it moved with the
    /// finger or springs back.
    pub fn moved_back(&mut self, travel: Millimetres, indentation: Millimetres) {
        self.surface = self.surface.min(Millimetres(travel.0.saturating_sub(indentation.0)));
        if self.place == Place::Before {
            self.place = Place::Known;
        }
    }

    /// Takes note that a release has backed off: from here on the array reads a residue.
    pub fn clear(&mut self, force: Newtons) {
        if !matches!(self.stage, Stage::None | Stage::Clear) {
            (self.stage, self.least, self.withheld) = (Stage::Clear, force, Newtons::ZERO);
            (self.frames, self.risen) = (0, 0);
        }
    }

    /// Takes note that another object is sought.
    pub fn seek(&mut self) {
        if self.stage == Stage::Clear {
            *self = Self::default();
        }
    }

    /// Prepares the record for torque: drops a doubtful touch and what is withheld, and marks a known surface as inherited.
    pub fn start(&mut self) {
        self.withheld = Newtons::ZERO;
        if self.stage == Stage::Doubtful {
            *self = Self::default();
        } else {
            self.doubt_place();
        }
    }

    /// Takes note that a release, a press or torque begins: what the array reads may be a residue until the force rises.
    pub fn doubt_place(&mut self) {
        if self.place == Place::Known {
            (self.place, self.least) = (Place::Inherited, self.before.0);
        }
    }

    /// Moves the surface when the zero of the travel moves by `zero`.
    pub fn shift(&mut self, zero: Millimetres) {
        self.surface = Millimetres(self.surface.0.saturating_sub(zero.0));
        self.seen_at = Millimetres(self.seen_at.0.saturating_sub(zero.0));
    }

    /// Weight with which the baseline learns this frame's reading, Q16; none while something may be pressed.
    ///
    /// `rows` is the number of rows: the baseline learns one in a frame.
    pub fn learns(&self, force: Newtons, rows: u32, config: &Config) -> Option<u32> {
        let light = force < config.contact_off;
        match self.stage {
            Stage::Held | Stage::Doubtful => None,
            Stage::None | Stage::Lost => light.then_some(DRIFT_WEIGHT),
            Stage::Clear => {
                let rounds = self.frames / rows;
                let residue = rounds < RESIDUE_ROUNDS && force.0 <= self.peak.0 >> RESIDUE_BITS;
                // The mean of all rounds since the contact, until they are as many as the filter holds.
                let weight = ((1 << 16) / rounds.saturating_add(FIRST_ROUNDS)).max(DRIFT_WEIGHT);
                (light || residue).then_some(weight)
            }
        }
    }
}

/// Travel at which the tip touches, from the present frame. Where a part of the contact is hidden, the indentation that
/// the motor measured counts if it is larger.
fn place(inputs: &TouchInputs, by_motor: Millimetres) -> Millimetres {
    let Contact { indentation, doubt, .. } = *inputs.contact;
    let deep = if doubt > 0 { indentation.max(by_motor) } else { indentation };
    Millimetres(inputs.travel.0.saturating_sub(deep.0))
}
