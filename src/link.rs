//! The bus: DYNAMIXEL Protocol 2.0, device side, independent of the port.
//!
//! ```text
//! bytes -> receiver -> packet -> server -> table -> settings -> command, record, actions for the firmware
//! bytes <- sender   <- reply  <-   "    <-   "   <- snapshot of the loop
//! ```
//! The firmware feeds received bytes to a [`Server`] together with a [`Snapshot`] of the loop, sends the reply,
//! passes [`Server::command`] on to the loop and carries out [`Server::take_actions`].
//!
//! Rules beyond those of the protocol:
//!
//! | subject | rule |
//! | --- | --- |
//! | write | all or nothing; covers whole registers: a partial one is a length error, a gap an access error |
//! | indirect data | read and written as the registers that the indirect addresses lead to |
//! | read | any bytes of the table, 0 where there is no register; beyond its end an access error; 1 to 256 bytes: length error otherwise |
//! | stored registers | written with torque off only; kept over a reset only once `save_parameters` was written |
//! | value beyond another register's limit, parameters that contradict each other | limit error |
//! | fault | torque enable and goal force go to 0; torque enable is refused (result error) until the fault is cleared: `recover` does all that this takes in one write |
//! | request that cannot be carried out in the present mode | result error: a tare in a fault that is not cleared by then, a press that measures without torque or tare, a save or Factory Reset while the loop drives or tares. A later failure shows in `tare_state`, `measure_state` and `saved_state`, also after a request without an answer |
//! | bus watchdog | counts from the last good instruction packet for this device, broadcasts included; on a trip it reads -1, and until 0 is written to it goals are refused (range error, as X-series servos do) and torque enable is (result error) |
//! | torque off | the goal is 0; goals above 0 are refused (result error), unless the same write enables torque |
//! | Reg Write | dropped by a fault, torque off, a goal of 0, `measure` 0 and `recover` |
//! | before the first tare | force and all values computed from it read 0 |
//! | damaged packet | CRC error where it seems to be for this device, silence otherwise; nothing is done |
//! | Sync Read, Bulk Read | answered after the status packet of the device before in the list is heard; silent where that one is |
//! | broadcast Ping | answered after 14 byte times for each lower ID |
//! | Action | answered like a write where it names this device; `dynamixel-sdk` does not read that answer, so let it pass |
//! | fast reads | answered in one packet to which each device adds its part; zeros, with the error, where a part cannot be read |
//! | Clear | `02 "ERCL"` is `recover`; there is no multi-turn position to clear (`01 "DXL\""`): range error |
//! | Control Table Backup | `01 "CTRL"` is `save_parameters`; there is no older backup to restore (`02 "CTRL"`): range error |
//! | Factory Reset, Reboot | as the protocol has them; Factory Reset needs torque off and saves |

mod checks;
pub mod packet;
pub mod server;
pub mod settings;
pub mod snapshot;
pub mod table;

pub use packet::{REPLY_MAX, Reply};
pub use server::Server;
pub use settings::{Actions, Settings};
pub use snapshot::{Captured, Crash, CrashCause, Health, ResetCause, Snapshot};
