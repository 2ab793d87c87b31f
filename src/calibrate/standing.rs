//! How a calibration stands, as the bus tells it.

/// Why a press was not taken. The numbers are stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[non_exhaustive]
pub enum Refusal {
    /// The plate yields: the readings do not grow with the travel as under something hard.
    Soft = 1,
    /// The contact wandered over the array, not evenly.
    Moving = 2,
    /// The contact's centre is too near to the array's edge.
    OffArray = 3,
    /// It is no flat plate, or one that moves evenly.
    NotFlat = 4,
    /// Too few taxels were pressed for long enough.
    TooLittle = 5,
    /// The contact was lost.
    Lost = 6,
    /// The travel ended without a contact.
    NoContact = 7,
    /// The tip did not move on for a second.
    Stalled = 8,
    /// Torque went off, a fault stopped the motor, or parameters or gains changed.
    Interrupted = 9,
    /// Torque is off or the array not tared: there is nothing to press with.
    NotReady = 10,
    /// All taxels together read less than half or more than twice of what the modulus says.
    Range = 11,
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Soft => "what is pressed yields: take something hard, as a glass or steel plate",
            Self::Moving => "the plate moved: hold finger and plate fast",
            Self::OffArray => "the contact is too near to the array's edge: press nearer the middle",
            Self::NotFlat => {
                "what is pressed is not flat, or moves: take a clean plate larger than the tip, hold it fast"
            }
            Self::TooLittle => "too few taxels were pressed: press deeper, force_max_mn allowing",
            Self::Lost => "the contact was lost: hold finger and plate fast",
            Self::NoContact => "the travel ended without a contact: bring the plate nearer",
            Self::Stalled => "the tip did not move on for a second: is the current too small?",
            Self::Interrupted => "torque went off, a fault stopped the motor, or parameters or gains changed",
            Self::NotReady => "torque is off or the array is not tared",
            Self::Range => {
                "all taxels read less than half or more than twice of what the modulus says: identify it first"
            }
        })
    }
}

impl core::error::Error for Refusal {}

/// How the last press stands. The numbers are stable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum State {
    /// None was asked for since reset.
    #[default]
    None,
    /// It is under way, or being evaluated.
    Running,
    /// It was taken.
    Done,
    /// It was not taken; what was before stands.
    Refused(Refusal),
}

impl State {
    /// 0 none, 1 running, 2 done, 3 refused.
    pub const fn number(self) -> u8 {
        match self {
            Self::None => 0,
            Self::Running => 1,
            Self::Done => 2,
            Self::Refused(_) => 3,
        }
    }

    /// The number of the [`Refusal`]; 0 where it was not refused.
    pub const fn refusal(self) -> u8 {
        if let Self::Refused(refusal) = self { refusal as u8 } else { 0 }
    }
}

/// How a calibration stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Standing {
    /// The last press.
    pub state: State,
    /// How far it is, percent.
    pub progress: u8,
    /// Presses taken.
    pub presses: u8,
    /// Taxels that have a proposal.
    pub reached: u16,
    /// Counts proposals: it changes with every new one.
    pub proposals: u8,
}
