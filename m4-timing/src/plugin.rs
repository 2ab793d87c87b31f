//! QEMU's plugin interface, version 4: the entry points that QEMU calls, and those of QEMU that are called.
//!
//! The only unsafe code of the crate. QEMU runs one virtual CPU here; its callbacks come from one thread, the last one
//! possibly from another, so all state lies behind a lock.

use crate::core::Touched;
use crate::decode::{decode, is_wide};
use crate::meter::{self, Meter, Registers, Site};
use std::collections::HashMap;
use std::ffi::{CStr, c_char, c_int, c_uint, c_void};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::{fs, path::PathBuf, ptr, slice};

type Id = u64;
type Block = c_void;
type Insn = c_void;

/// GLib's growing array, of bytes or of anything else.
#[repr(C)]
struct Array<T> {
    data: *const T,
    len: c_uint,
}

#[repr(C)]
struct RegisterDescriptor {
    handle: *mut c_void,
    name: *const c_char,
    feature: *const c_char,
}

// SAFETY: these are the declarations of `qemu-plugin.h`, of GLib and of the C library. QEMU has all of them.
unsafe extern "C" {
    fn qemu_plugin_register_vcpu_init_cb(id: Id, callback: extern "C" fn(Id, c_uint));
    fn qemu_plugin_register_vcpu_tb_trans_cb(id: Id, callback: extern "C" fn(Id, *mut Block));
    fn qemu_plugin_register_atexit_cb(id: Id, callback: extern "C" fn(Id, *mut c_void), data: *mut c_void);
    fn qemu_plugin_tb_n_insns(block: *const Block) -> usize;
    fn qemu_plugin_tb_get_insn(block: *const Block, index: usize) -> *mut Insn;
    fn qemu_plugin_insn_data(insn: *const Insn, data: *mut c_void, length: usize) -> usize;
    fn qemu_plugin_insn_vaddr(insn: *const Insn) -> u64;
    fn qemu_plugin_register_vcpu_insn_exec_cb(
        insn: *mut Insn,
        callback: extern "C" fn(c_uint, *mut c_void),
        flags: c_int,
        data: *mut c_void,
    );
    fn qemu_plugin_register_vcpu_mem_cb(
        insn: *mut Insn,
        callback: extern "C" fn(c_uint, u32, u64, *mut c_void),
        flags: c_int,
        which: c_int,
        data: *mut c_void,
    );
    fn qemu_plugin_mem_size_shift(info: u32) -> c_uint;
    fn qemu_plugin_mem_is_store(info: u32) -> bool;
    fn qemu_plugin_get_registers() -> *mut Array<RegisterDescriptor>;
    fn qemu_plugin_read_register(handle: *mut c_void, bytes: *mut Array<u8>) -> c_int;
    fn _exit(status: c_int) -> !;
    fn g_byte_array_new() -> *mut Array<u8>;
    fn g_byte_array_set_size(array: *mut Array<u8>, length: c_uint) -> *mut Array<u8>;
}

/// The interface that this plugin speaks.
#[unsafe(no_mangle)]
pub static qemu_plugin_version: c_int = 4;
/// The callback reads the guest's registers.
const READS_REGISTERS: c_int = 1;
/// QEMU's exit status where a region cannot be measured.
const FAILED: c_int = 3;
const NO_REGISTERS: c_int = 0;
const LOADS_AND_STORES: c_int = 3;
const CORE_REGISTERS: [&CStr; 15] =
    [c"r0", c"r1", c"r2", c"r3", c"r4", c"r5", c"r6", c"r7", c"r8", c"r9", c"r10", c"r11", c"r12", c"sp", c"lr"];

static PLUGIN: OnceLock<Mutex<Plugin>> = OnceLock::new();
/// True if a region is being measured: the callbacks outside of one end here.
static RUNNING: AtomicBool = AtomicBool::new(false);

struct Plugin {
    meter: Meter,
    out: Option<PathBuf>,
    sites: HashMap<(u32, u32), &'static Site>,
    registers: Option<Handles>,
}

/// The guest's registers.
struct Handles {
    core: [*mut c_void; 15],
    xpsr: *mut c_void,
    bytes: *mut Array<u8>,
}

// SAFETY: QEMU's handles name registers and belong to no thread; the lock around the plugin guards the array.
unsafe impl Send for Handles {}

impl Handles {
    fn new() -> Self {
        // SAFETY: called when the virtual CPU starts, as QEMU demands. The array lives on, and its names are C strings.
        let (registers, bytes) = unsafe {
            let array = qemu_plugin_get_registers();
            let registers = match array.as_ref() {
                Some(array) if !array.data.is_null() => slice::from_raw_parts(array.data, array.len as usize),
                _ => &[],
            };
            (registers, g_byte_array_new())
        };
        let find = |name: &CStr| {
            let register = registers.iter().find(|register| {
                // SAFETY: as above.
                !register.name.is_null() && unsafe { CStr::from_ptr(register.name) } == name
            });
            register.map_or_else(|| fail(&format!("this QEMU shows no register {name:?}")), |register| register.handle)
        };
        Self { core: CORE_REGISTERS.map(find), xpsr: find(c"xpsr"), bytes }
    }

    fn read(&self, handle: *mut c_void) -> u32 {
        // SAFETY: the handle is QEMU's, the array GLib's; callers come from a callback that may read registers.
        let word = unsafe {
            g_byte_array_set_size(self.bytes, 0);
            let length = qemu_plugin_read_register(handle, self.bytes);
            if length == 4 {
                ptr::read_unaligned((*self.bytes).data.cast::<[u8; 4]>())
            } else {
                fail("QEMU reads no register")
            }
        };
        u32::from_le_bytes(word)
    }
}

impl Registers for &Handles {
    fn core(&mut self, number: u8) -> u32 {
        self.core.get(usize::from(number)).map_or(0, |handle| self.read(*handle))
    }

    fn xpsr(&mut self) -> u32 {
        self.read(self.xpsr)
    }
}

/// QEMU loads the plugin.
///
/// # Safety
/// QEMU calls it, with `count` C strings in `words`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn qemu_plugin_install(
    id: Id,
    _: *const c_void,
    count: c_int,
    words: *const *const c_char,
) -> c_int {
    let count = usize::try_from(count).unwrap_or(0);
    let mut out = None;
    for index in 0..count {
        // SAFETY: QEMU passes that many C strings.
        let word = unsafe { CStr::from_ptr(*words.add(index)) }.to_string_lossy();
        match word.split_once('=') {
            Some(("out", path)) => out = Some(PathBuf::from(path)),
            _ => {
                eprintln!("m4-timing: no such option: {word}; there is out=FILE");
                return 1;
            }
        }
    }
    let plugin = Plugin { meter: Meter::default(), out, sites: HashMap::new(), registers: None };
    let _ = PLUGIN.set(Mutex::new(plugin));
    // SAFETY: QEMU called us, and these callbacks have the types that it expects.
    unsafe {
        qemu_plugin_register_vcpu_init_cb(id, started);
        qemu_plugin_register_vcpu_tb_trans_cb(id, translated);
        qemu_plugin_register_atexit_cb(id, ended, ptr::null_mut());
    }
    0
}

extern "C" fn started(_: Id, _: c_uint) {
    with(|plugin| plugin.registers = Some(Handles::new()));
}

/// QEMU translated a block of guest code: decode it, and ask to be called for each of its instructions.
extern "C" fn translated(_: Id, block: *mut Block) {
    with(|plugin| {
        // SAFETY: the block is QEMU's and lives for this call.
        let count = unsafe { qemu_plugin_tb_n_insns(block) };
        for index in 0..count {
            // SAFETY: as above; the index is within the block. At most four bytes are written.
            let (insn, address, bytes, length) = unsafe {
                let insn = qemu_plugin_tb_get_insn(block, index);
                let mut bytes = [0u8; 4];
                let length = qemu_plugin_insn_data(insn, bytes.as_mut_ptr().cast(), bytes.len());
                (insn, qemu_plugin_insn_vaddr(insn) as u32, bytes, length)
            };
            let site = plugin.site(address, bytes, length);
            let accesses = site.code.is_ok_and(|instruction| instruction.accesses_memory());
            let data = ptr::from_ref(site).cast_mut().cast();
            // SAFETY: the site is never freed and never written.
            unsafe {
                qemu_plugin_register_vcpu_insn_exec_cb(insn, executed, READS_REGISTERS, data);
                if accesses {
                    qemu_plugin_register_vcpu_mem_cb(insn, accessed, NO_REGISTERS, LOADS_AND_STORES, ptr::null_mut());
                }
            }
        }
    });
}

impl Plugin {
    /// A place in the code, kept for ever: QEMU may call with it at any time.
    fn site(&mut self, address: u32, bytes: [u8; 4], length: usize) -> &'static Site {
        let length = if is_wide(u16::from_le_bytes([bytes[0], bytes[1]])) { length.min(4) } else { length.min(2) };
        let key = (address, u32::from_le_bytes(bytes));
        self.sites.entry(key).or_insert_with(|| {
            let code = decode(bytes.get(..length).unwrap_or_default());
            Box::leak(Box::new(Site { address, code }))
        })
    }
}

extern "C" fn executed(_: c_uint, data: *mut c_void) {
    // SAFETY: this is a site that `translated` gave away, never freed.
    let site = unsafe { &*data.cast::<Site>().cast_const() };
    if !RUNNING.load(Ordering::Relaxed) && !site.is_marker() {
        return;
    }
    with(|plugin| {
        let Some(registers) = &plugin.registers else { fail("QEMU started no CPU") };
        if let Err(refusal) = plugin.meter.execute(site, &mut &*registers) {
            fail(&format!("not measured: {refusal}"));
        }
        RUNNING.store(plugin.meter.running(), Ordering::Relaxed);
    });
}

extern "C" fn accessed(_: c_uint, info: u32, address: u64, _: *mut c_void) {
    if RUNNING.load(Ordering::Relaxed) {
        // SAFETY: QEMU gave this description of an access for this call.
        let (shift, store) = unsafe { (qemu_plugin_mem_size_shift(info), qemu_plugin_mem_is_store(info)) };
        with(|plugin| plugin.meter.access(Touched { address: address as u32, bytes: 1 << (shift & 7) }, store));
    }
}

/// The guest ended: report.
extern "C" fn ended(_: Id, _: *mut c_void) {
    with(|plugin| {
        let regions = match plugin.meter.finish() {
            Ok(regions) => regions,
            Err(refusal) => fail(&format!("not measured: {refusal}")),
        };
        if let Some(path) = &plugin.out
            && let Err(error) = fs::write(path, meter::json_lines(&meter::measured(regions)))
        {
            fail(&format!("cannot write {}: {error}", path.display()));
        }
    });
}

fn with<T>(work: impl FnOnce(&mut Plugin) -> T) -> T {
    let Some(plugin) = PLUGIN.get() else { fail("QEMU did not install the plugin") };
    work(&mut plugin.lock().unwrap_or_else(PoisonError::into_inner))
}

/// Ends QEMU at once, without its own farewells: they would come back here.
fn fail(what: &str) -> ! {
    eprintln!("m4-timing: {what}");
    // SAFETY: ends the process, nothing else.
    unsafe { _exit(FAILED) }
}
