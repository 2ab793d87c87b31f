//! Everything a user may set: the fingertip, the array, the motor and the limits, with their ranges.
//!
//! Stored and sent as integers in the unit that the field's name ends with, so a record is exact on the bus, in flash
//! and in a file. [`Params::check`] is the one gate; what it lets through cannot make the loop fail.

/// A parameter out of its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParamError {
    /// The field of [`Params`].
    pub name: &'static str,
    /// Requested value.
    pub value: i32,
    /// The least value allowed.
    pub min: i32,
    /// The largest value allowed.
    pub max: i32,
}

impl core::fmt::Display for ParamError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self { name, value, min, max } = self;
        write!(f, "{name} of {value}: {min} to {max} are allowed")
    }
}

impl core::error::Error for ParamError {}

macro_rules! params {
    ($($(#[doc = $doc:literal])+ $name:ident = $default:literal in $min:literal ..= $max:literal;)*) => {
        /// The stored parameters, in the units that their names end with.
        ///
        /// ```
        /// use fingertip::params::Params;
        ///
        /// let harder = Params { modulus_pa: 400_000, ..Params::DEFAULT };
        /// assert!(harder.check().is_ok());
        /// let wrong = Params { modulus_pa: 4, ..Params::DEFAULT };
        /// assert_eq!(wrong.check().unwrap_err().to_string(), "modulus_pa of 4: 20000 to 2000000 are allowed");
        /// ```
        #[derive(Clone, Copy, Debug, Eq)]
        pub struct Params { $($(#[doc = $doc])+ pub $name: i32,)* }

        impl Params {
            /// Number of parameters.
            pub const COUNT: usize = [$(stringify!($name)),*].len();

            /// The parameters of the reference finger, described in `docs/board.md`.
            pub const DEFAULT: Self = Self { $($name: $default,)* };

            /// Refuses the first parameter that is out of its range.
            pub fn check(&self) -> Result<(), ParamError> {
                let mut all = Self::RANGES.iter().zip(self.to_array());
                match all.find(|&(&(_, _, min, max), value)| value < min || value > max) {
                    Some((&(name, _, min, max), value)) => Err(ParamError { name, value, min, max }),
                    None => Ok(()),
                }
            }

            /// The values in the order of their definition, for storage.
            // Not inlined, as the inverse: each of the values takes instructions of its own.
            #[inline(never)]
            pub const fn to_array(&self) -> [i32; Self::COUNT] { [$(self.$name),*] }

            /// The inverse of [`Params::to_array`]; unchecked.
            #[inline(never)]
            pub const fn from_array(values: &[i32; Self::COUNT]) -> Self {
                let [$($name),*] = *values;
                Self { $($name),* }
            }

            /// Name, default, least and largest value of each, in order.
            pub const RANGES: [(&'static str, i32, i32, i32); Self::COUNT] =
                [$((stringify!($name), $default, $min, $max)),*];

            /// Documentation of each parameter, in order.
            pub const DOCS: [&'static str; Self::COUNT] = [$(concat!($($doc),+)),*];
        }
    };
}

params! {
    /// Radius a of the hemispherical tip.
    tip_radius_um = 10_000 in 4_000..=16_000;
    /// Young's modulus Y of the tip.
    modulus_pa = 250_000 in 20_000..=2_000_000;
    /// Distance from taxel to taxel.
    pitch_um = 1_500 in 500..=4_000;
    /// Settle time of a row before its conversions.
    settle_ns = 2_400 in 500..=100_000;
    /// Sampling time in converter cycles, one of `Clocks::sample_cycles`: 3, 15,
    /// 28, 56, 84, 112, 144 and 480 on the STM32F446. Half cycles are rounded up.
    sample_cycles = 15 in 3..=480;
    /// Converter codes per kPa on a taxel, thousandths.
    codes_per_kpa_milli = 24_000 in 1_000..=200_000;
    /// Share of the row's voltage lost in the row driver's resistance per code
    /// of the row's sum, parts per billion: R_on / (R_f V_drive 4096 / V_ref).
    row_sag_ppb_per_code = 1_667 in 0..=7_600;
    /// A taxel is dead if it reads less than this above
    /// its column's undriven level: its preload is gone.
    dead_codes = 12 in 1..=1_000;
    /// A column that reads more than this with no row driven shows a row that is stuck on.
    undriven_max_codes = 700 in 0..=4_000;
    /// More dead or saturated taxels than this are a fault.
    bad_taxels_max = 5 in 0..=100;
    /// Contact begins above this force; lower goals are held
    /// as this. Above contact_off_mn, below force_max_mn.
    contact_on_mn = 40 in 5..=2_000;
    /// Contact ends below this force. Below contact_on_mn.
    contact_off_mn = 15 in 1..=2_000;
    /// The baseline follows drift without contact: 1 yes, 0 no.
    baseline_follows = 1 in 0..=1;
    /// Torque constant of the motor.
    torque_constant_unm_per_a = 5_350 in 100..=200_000;
    /// Resistance of motor and bridge together.
    resistance_mohm = 3_530 in 50..=200_000;
    /// Inertia of rotor and gear at the shaft (1 g cm^2 is 100).
    inertia_ug_m2 = 71 in 1..=20_000;
    /// Coulomb friction at the shaft.
    friction_unm = 120 in 0..=20_000;
    /// Motor angle per tip travel: gear ratio over the radius of drum or crank.
    reduction_mrad_per_mm = 3_583 in 100..=50_000;
    /// Quadrature counts per turn of the motor.
    encoder_counts_per_turn = 1_600 in 16..=65_536;
    /// Largest voltage at the motor.
    voltage_max_mv = 6_000 in 500..=48_000;
    /// Largest current, by the motor model.
    current_max_ma = 2_000 in 20..=20_000;
    /// Largest slew of the motor's voltage.
    voltage_slew_mv_per_ms = 60_000 in 3_000..=1_000_000;
    /// Largest speed of the tip. At least approach_um_per_s.
    speed_max_um_per_s = 250_000 in 1_000..=2_000_000;
    /// Speed of approach, and of a release from an unsure contact. At most speed_max_um_per_s.
    approach_um_per_s = 30_000 in 500..=200_000;
    /// Largest travel from where the motor was first driven.
    travel_max_um = 20_000 in 100..=100_000;
    /// Distance behind the surface to which a release goes.
    clearance_um = 1_000 in 500..=20_000;
    /// Over-force: above this the motor stops. Above force_max_mn.
    force_fault_mn = 9_000 in 100..=200_000;
    /// Largest goal; higher ones are refused. Above contact_on_mn, below force_fault_mn.
    force_max_mn = 7_000 in 50..=150_000;
    /// The motor stops below this supply. Below supply_max_mv.
    supply_min_mv = 5_000 in 1_000..=48_000;
    /// The motor stops above this supply. Above supply_min_mv.
    supply_max_mv = 8_500 in 2_000..=60_000;
    /// Characteristic of the array: how much more force per code at the converter's
    /// full range than at small codes; 0 is a line. Otherwise codes_per_kpa_milli
    /// is that of small pressures, and must leave 1,000 at the full range.
    curve_permille = 0 in 0..=8_000;
    /// Creep of the array: final growth of the reading of a held force. 0 turns the compensation off.
    creep_permille = 0 in 0..=300;
    /// Time constant of the creep.
    creep_time_ms = 10_000 in 50..=600_000;
    /// 1: positive duty moves the tip towards the object, and in the jog the encoder
    /// then counted up. 0: unknown, torque is refused. See `docs/commissioning.md`.
    direction_confirmed = 0 in 0..=1;
    /// Largest winding temperature: the current falls below it (limit 13).
    winding_max_c = 125 in 85..=250;
    /// Thermal resistance from winding to housing; 0 leaves it out. If
    /// housing_k_per_w is also 0, the winding counts as warm as its surroundings.
    winding_k_per_w = 20 in 0..=500;
    /// Thermal time constant of the winding.
    winding_time_ms = 5_000 in 2_000..=600_000;
    /// Thermal resistance from housing to surroundings.
    housing_k_per_w = 26 in 0..=500;
    /// Thermal time constant of the housing.
    housing_time_ms = 400_000 in 2_000..=10_000_000;
    /// Largest temperature around the motor.
    ambient_c = 40 in -40..=60;
    /// Change of the array's gain with the microcontroller's temperature. 0 turns the compensation off.
    array_gain_ppm_per_k = 0 in -10_000..=10_000;
    /// Microcontroller's temperature at which the array's gain is right.
    array_gain_at_c = 25 in -40..=125;
    /// Change of each taxel's zero with the microcontroller's temperature
    /// since the zero was last learnt. 0 turns the compensation off.
    array_zero_pa_per_k = 0 in -1_000..=1_000;
    /// A taxel counts as saturated this far below the largest code, 4,095,
    /// because a column amplifier may clip there. 255 codes are 205 mV.
    headroom_codes = 255 in 5..=2_000;
}

// Not derived, which takes ten times as much flash. Word by word: the array's own comparison is byte by byte.
impl PartialEq for Params {
    fn eq(&self, other: &Self) -> bool {
        self.to_array().iter().eq(&other.to_array())
    }
}

impl Default for Params {
    fn default() -> Self {
        Self::DEFAULT
    }
}
