//! The STM32F4's flash with its accelerator: wait states, a cache of instruction lines with the next line fetched
//! ahead, and a small cache of data lines.
//!
//! The flash is 128 bits wide. A line that is neither cached nor on its way costs the wait states; a line that is on its
//! way costs what is left of them. Addresses outside the flash cost nothing. When the core enters a line, the next one
//! is fetched if it is not cached, in straight code two cycles earlier. The caches replace the least recently used line.

/// Bits of an address within a line of 128 bits.
const LINE_BITS: u32 = 4;
/// Addresses below this are flash: the aliases at zero and the flash itself, but not the core-coupled memory.
const FLASH_END: u32 = 0x1000_0000;

/// Cycles by which the core's own fetches run ahead of execution in straight code: it buffers three words.
const LEAD: u64 = 2;

/// Lines of the largest flash, 2 MiB; its aliases are the same lines.
const FLASH_LINES: usize = 1 << 17;

/// Properties of a part's flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Wait states of an access.
    pub wait_states: u32,
    /// Lines of the instruction cache.
    pub instruction_lines: usize,
    /// Lines of the data cache.
    pub data_lines: usize,
}

impl Settings {
    /// An STM32F4 at 168 MHz and 3.3 V.
    pub const STM32F4: Self = Self { wait_states: 5, instruction_lines: 64, data_lines: 8 };
}

/// The flash and its accelerator.
#[derive(Clone, Debug)]
pub struct Flash {
    wait_states: u64,
    instructions: Cache,
    data: Cache,
    /// The line that the core executes from.
    current: Option<u32>,
    /// Line being fetched, and cycle of its arrival.
    ahead: Option<(u32, u64)>,
    /// Cycle from which the flash is free for another access.
    free: u64,
    now: u64,
}

impl Flash {
    /// Cold caches.
    pub fn new(settings: Settings) -> Self {
        Self {
            wait_states: settings.wait_states.into(),
            instructions: Cache::new(settings.instruction_lines),
            data: Cache::new(settings.data_lines),
            current: None,
            ahead: None,
            free: 0,
            now: 0,
        }
    }

    /// Cycles since the beginning, with those that the core waited.
    pub fn now(&self) -> u64 {
        self.now
    }

    /// The core works on.
    pub fn pass(&mut self, cycles: u64) {
        self.now += cycles;
    }

    /// The core executes an instruction of `size` bytes from here.
    pub fn fetch(&mut self, address: u32, size: u32) {
        for line in [address >> LINE_BITS, address.wrapping_add(size - 1) >> LINE_BITS] {
            if self.current != Some(line) {
                let straight = self.current == line.checked_sub(1);
                self.current = Some(line);
                self.enter(line, straight);
            }
        }
    }

    /// The core reads data.
    pub fn read(&mut self, address: u32) {
        let line = address >> LINE_BITS;
        if is_flash(line) && !self.data.touch(line) {
            self.access();
            self.data.insert(line);
        }
    }

    fn enter(&mut self, line: u32, straight: bool) {
        if !is_flash(line) {
            return;
        }
        if !self.instructions.touch(line) {
            match self.ahead {
                Some((on_its_way, arrives)) if on_its_way == line => self.now = self.now.max(arrives),
                _ => self.access(),
            }
            self.instructions.insert(line);
        }
        let next = line + 1;
        if !self.instructions.contains(next) && self.ahead.is_none_or(|(line, _)| line != next) {
            let asked = self.now.saturating_sub(if straight { LEAD } else { 0 });
            let arrives = asked.max(self.free) + self.wait_states;
            self.ahead = Some((next, arrives));
            self.free = arrives + 1;
        }
    }

    /// Waits for the flash, and for what it is asked.
    fn access(&mut self) {
        self.now = self.now.max(self.free) + self.wait_states;
        self.free = self.now + 1;
    }
}

fn is_flash(line: u32) -> bool {
    line < FLASH_END >> LINE_BITS
}

/// Lines, the longest unused one goes first.
#[derive(Clone, Debug)]
struct Cache {
    lines: Vec<usize>,
    size: usize,
    /// Last use of each line of the flash; 0 if it is not cached.
    used: Vec<u64>,
    uses: u64,
}

impl Cache {
    fn new(size: usize) -> Self {
        Self { lines: Vec::with_capacity(size), size, used: vec![0; FLASH_LINES], uses: 0 }
    }

    fn contains(&self, line: u32) -> bool {
        self.used[line as usize % FLASH_LINES] != 0
    }

    /// True if a line is there; it then counts as just used.
    fn touch(&mut self, line: u32) -> bool {
        let there = self.contains(line);
        if there {
            self.use_now(line as usize % FLASH_LINES);
        }
        there
    }

    fn insert(&mut self, line: u32) {
        let line = line as usize % FLASH_LINES;
        if self.lines.len() < self.size {
            self.lines.push(line);
        } else if let Some(oldest) = self.lines.iter_mut().min_by_key(|line| self.used[**line]) {
            self.used[*oldest] = 0;
            *oldest = line;
        }
        self.use_now(line);
    }

    fn use_now(&mut self, line: usize) {
        self.uses += 1;
        self.used[line] = self.uses;
    }
}
