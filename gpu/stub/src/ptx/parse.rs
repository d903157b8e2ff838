//! Kernels from their PTX, as LLVM writes it.
//!
//! Nothing recurses: so every function has registers, parameters and local memory of its own, at fixed places.

use std::collections::HashMap;

use super::cost::{Cost, cost};
use super::declared::{bytes_of, declared};
use super::function::{Function, LOCAL, check_stored, function};

/// Where a number comes from.
#[derive(Clone, Copy)]
pub enum Operand {
    Register(u32),
    Constant(u64),
    /// An address within the thread's own memory.
    Own(u64),
    /// `%ctaid.x`, `%ntid.x`, `%tid.x`.
    Block,
    BlockSize,
    Thread,
}

/// Effect of an instruction.
#[derive(Clone)]
pub enum Action {
    Compute(Function),
    /// Loads so many numbers of so many bytes.
    Load {
        count: usize,
        bytes: usize,
    },
    Store {
        count: usize,
        bytes: usize,
    },
    AtomicAdd,
    /// The value of another thread of the warp (`shfl.sync.idx`).
    Shuffle,
    /// A bit of each of some threads (`vote.sync.ballot`).
    Ballot,
    /// The halves of a number, of so many bits each.
    Split(u32),
    Branch(usize),
    /// To one of these, by the number of the operand.
    Switch(Vec<usize>),
    Call {
        to: usize,
        arguments: Vec<[usize; 3]>,
        result: Option<[usize; 3]>,
    },
    Return,
}

/// An instruction.
#[derive(Clone)]
pub struct Instruction {
    pub action: Action,
    /// The predicate, and what it must be.
    pub guard: Option<(u32, bool)>,
    pub results: Vec<u32>,
    pub operands: [Operand; 4],
    /// Address of memory, to which the offset is added.
    pub address: Operand,
    pub offset: u64,
    pub cost: Cost,
    /// Does it load or store in local memory by an address of that memory?
    pub is_local: bool,
    /// Line of 128 bytes of machine code, from 1 on.
    pub line: u64,
    /// A branch leads here.
    pub is_target: bool,
}

/// Machine instructions in a line of code.
const SLOTS_OF_LINE: u64 = 8;

/// A kernel.
#[derive(Clone)]
pub struct Entry {
    pub start: usize,
    /// Place in the thread's own memory and length of each argument.
    pub parameters: Vec<(usize, usize)>,
}

/// A file of PTX.
#[derive(Default)]
pub struct Module {
    pub code: Vec<Instruction>,
    pub entries: HashMap<String, Entry>,
    pub registers: usize,
    /// Bytes of a thread's own memory: parameters and local arrays of all functions.
    pub own_bytes: usize,
}

/// Start of a function, and places of its parameters and result; of a call those of the caller.
struct Signature {
    start: usize,
    parameters: Vec<(usize, usize)>,
    result: Option<(usize, usize)>,
}

struct Parser {
    module: Module,
    functions: HashMap<String, Signature>,
    /// Bytes of constants, which stay for good.
    constants: HashMap<String, u64>,
    /// Within the function: registers, places in the thread's own memory, labels.
    registers: HashMap<String, u32>,
    places: HashMap<String, (usize, usize)>,
    labels: HashMap<String, usize>,
    tables: HashMap<String, Vec<String>>,
    /// Branches and calls of the function, whose ends are not known yet.
    branches: Vec<(usize, Vec<String>)>,
    calls: Vec<(usize, String, Signature)>,
}

/// The kernels of a file. Panics with the line at anything that it does not know.
pub fn parse(text: &str) -> Module {
    let mut parser = Parser {
        module: Module::default(),
        functions: HashMap::new(),
        constants: HashMap::new(),
        registers: HashMap::new(),
        places: HashMap::new(),
        labels: HashMap::new(),
        tables: HashMap::new(),
        branches: vec![],
        calls: vec![],
    };
    let mut lines = text.lines().map(|line| line.split("//").next().unwrap_or("").trim());
    while let Some(line) = lines.next() {
        if line.starts_with(".global") {
            parser.constant(line);
        } else if line.starts_with(".visible .entry") || line.starts_with(".func") {
            let mut head = line.to_owned();
            while !head.ends_with(['{', ';']) {
                head += lines.next().expect("the end of a function's head");
            }
            if head.ends_with('{') {
                parser.head(&head);
                parser.body(&mut lines);
            }
        }
    }
    parser.link_calls();
    let mut slots = 0;
    for instruction in &mut parser.module.code {
        instruction.line = 1 + slots / SLOTS_OF_LINE;
        slots += u64::from(instruction.cost.slots);
    }
    parser.module
}

impl Parser {
    fn constant(&mut self, line: &str) {
        let (declaration, values) = line.split_once(" = ").expect("a constant with its bytes");
        let (name, length) = declared(declaration);
        let mut bytes = vec![0_u64; length.div_ceil(8)];
        let listed = values.trim_matches(['{', '}', ';']).split(", ").map(|byte| byte.parse::<u8>().expect("a byte"));
        for (index, byte) in listed.enumerate() {
            bytes[index / 8] |= u64::from(byte) << (8 * (index % 8));
        }
        self.constants.insert(name.to_owned(), bytes.leak().as_ptr() as u64);
    }

    /// Room in the thread's own memory.
    fn place(&mut self, text: &str) -> (usize, usize) {
        let (name, length) = declared(text);
        let start = self.module.own_bytes.next_multiple_of(16);
        self.module.own_bytes = start + length;
        self.places.insert(name.to_owned(), (start, length));
        (start, length)
    }

    fn head(&mut self, head: &str) {
        (self.registers, self.places, self.labels) = (HashMap::new(), HashMap::new(), HashMap::new());
        let is_entry = head.starts_with(".visible");
        let mut head = head.trim_start_matches(".visible .entry").trim_start_matches(".func").trim();
        let result = head.strip_prefix('(').map(|rest| {
            let (result, rest) = rest.split_once(')').expect("a result");
            head = rest.trim();
            self.place(result)
        });
        let (name, rest) = head.split_once('(').expect("a name with parameters");
        let list = rest.split(')').next().unwrap_or("");
        let parameters: Vec<_> =
            list.split(',').filter(|text| !text.trim().is_empty()).map(|text| self.place(text)).collect();
        let start = self.module.code.len();
        if is_entry {
            self.module.entries.insert(name.trim().to_owned(), Entry { start, parameters });
        } else {
            self.functions.insert(name.trim().to_owned(), Signature { start, parameters, result });
        }
    }

    fn body<'a>(&mut self, lines: &mut impl Iterator<Item = &'a str>) {
        let mut depth = 1;
        while let Some(line) = lines.next() {
            if let Some((name, _)) = line.split_once(": .branchtargets") {
                let mut list = vec![];
                loop {
                    let label = lines.next().expect("a label");
                    list.push(label.trim_matches([',', ';']).to_owned());
                    if label.ends_with(';') {
                        break;
                    }
                }
                self.tables.insert(name.to_owned(), list);
                continue;
            }
            // Brackets stand alone, around calls, or around the statements of inline assembly.
            let is_split = ["mov.b64 {", "mov.b32 {"].iter().any(|start| line.contains(start));
            let line = if is_split { line.trim_start_matches("{ ").trim_end_matches('}') } else { line };
            depth += if is_split { 0 } else { line.matches('{').count() };
            depth -= if is_split { 0 } else { line.matches('}').count() };
            if depth == 0 {
                break;
            }
            let is_vector = line.contains('{') && line.contains('}') && line.contains(".v");
            let line =
                if is_split || is_vector || line.contains("mov.b") { line } else { line.trim_matches(['{', '}', ' ']) };
            if let Some(label) = line.strip_suffix(':') {
                self.labels.insert(label.to_owned(), self.module.code.len());
                continue;
            }
            for statement in line.split(';').map(str::trim).filter(|text| !text.is_empty() && *text != "}") {
                self.statement(statement);
            }
        }
        for (at, names) in std::mem::take(&mut self.branches) {
            let ends: Vec<usize> = names.iter().map(|name| self.labels[name]).collect();
            ends.iter().for_each(|end| self.module.code[*end].is_target = true);
            match &mut self.module.code[at].action {
                Action::Branch(end) => *end = ends[0],
                Action::Switch(all) => *all = ends,
                _ => unreachable!("a branch"),
            }
        }
    }

    fn register(&mut self, name: &str) -> u32 {
        let next = self.module.registers as u32;
        let register = *self.registers.entry(name.to_owned()).or_insert(next);
        self.module.registers += usize::from(register == next);
        register
    }

    fn operand(&mut self, text: &str) -> Operand {
        match text {
            "%ctaid.x" => return Operand::Block,
            "%ntid.x" => return Operand::BlockSize,
            "%tid.x" => return Operand::Thread,
            _ => {}
        }
        let hex = |digits: &str| u64::from_str_radix(digits.trim_end_matches('U'), 16).expect("a number");
        if let Some(digits) = text.strip_prefix("0f").or(text.strip_prefix("0d")) {
            Operand::Constant(hex(digits))
        } else if let Some(digits) = text.strip_prefix("0x") {
            Operand::Constant(hex(digits))
        } else if let Ok(number) = text.parse::<i128>() {
            Operand::Constant(number as u64)
        } else if let Some((start, _)) = self.places.get(text) {
            Operand::Own(*start as u64 | if text.starts_with("__local") { LOCAL } else { 0 })
        } else if let Some(address) = self.constants.get(text) {
            Operand::Constant(*address)
        } else {
            Operand::Register(self.register(text))
        }
    }

    fn statement(&mut self, text: &str) {
        if text.starts_with(".param") || text.starts_with(".local") {
            self.place(text);
            return;
        }
        if text.starts_with('.') {
            return;
        }
        let (guard, text) = match text.strip_prefix('@') {
            Some(rest) => {
                let (guard, rest) = rest.split_once(char::is_whitespace).expect("a guard");
                let name = guard.trim_start_matches('!');
                (Some((self.register(name), name == guard)), rest.trim())
            }
            None => (None, text),
        };
        let (operation, rest) =
            text.split_once(char::is_whitespace).map_or((text, ""), |(start, rest)| (start, rest.trim()));
        let is_memory = ["ld.", "st.", "atom."].iter().any(|start| operation.starts_with(start));
        let words: Vec<&str> = rest.split([',', ' ', '\t', '{', '}']).filter(|word| !word.is_empty()).collect();
        let mut instruction = Instruction {
            action: Action::Return,
            guard,
            results: vec![],
            operands: [Operand::Constant(0); 4],
            address: Operand::Constant(0),
            offset: 0,
            cost: cost(operation),
            is_local: operation.contains(".local."),
            line: 0,
            is_target: false,
        };
        if is_memory {
            self.access(operation, words, &mut instruction);
        } else if operation.starts_with("bra") {
            instruction.action = Action::Branch(0);
            self.branches.push((self.module.code.len(), vec![words[0].to_owned()]));
        } else if operation == "brx.idx" {
            instruction.action = Action::Switch(vec![]);
            instruction.operands[0] = self.operand(words[0]);
            self.branches.push((self.module.code.len(), self.tables[words[1]].clone()));
        } else if operation.starts_with("call") {
            self.call(rest, &mut instruction);
        } else if matches!(operation, "ret" | "exit" | "trap") {
        } else if operation == "shfl.sync.idx.b32" {
            instruction.action = Action::Shuffle;
            instruction.results = vec![self.register(words[0])];
            instruction.operands = [1, 2, 3, 4].map(|k| self.operand(words[k]));
        } else if operation == "vote.sync.ballot.b32" {
            instruction.action = Action::Ballot;
            instruction.results = vec![self.register(words[0])];
            (instruction.operands[0], instruction.operands[3]) = (self.operand(words[1]), self.operand(words[2]));
        } else if operation.starts_with("mov.b") && rest.starts_with('{') {
            instruction.action = Action::Split(if operation == "mov.b64" { 32 } else { 16 });
            instruction.results = words[..2].iter().map(|word| self.register(word)).collect();
            instruction.operands[0] = self.operand(words[2]);
        } else {
            let function = function(operation).unwrap_or_else(|| panic!("the operation {text}"));
            instruction.action = Action::Compute(function);
            instruction.results = vec![self.register(words[0])];
            for (operand, word) in instruction.operands.iter_mut().zip(&words[1..]) {
                *operand = self.operand(word);
            }
        }
        self.module.code.push(instruction);
    }

    /// Address, offset and what is loaded or stored.
    fn access(&mut self, operation: &str, mut words: Vec<&str>, instruction: &mut Instruction) {
        let at = words.iter().position(|word| word.starts_with('[')).expect("an address");
        let (address, offset) =
            words[at].trim_matches(['[', ']']).split_once('+').unwrap_or((words[at].trim_matches(['[', ']']), "0"));
        instruction.offset = offset.parse::<i64>().unwrap_or_else(|_| panic!("the offset {offset}")) as u64;
        instruction.address = self.operand(address);
        words.remove(at);
        let bytes = bytes_of(operation.rsplit('.').next().unwrap_or(""));
        let is_atomic = operation.starts_with("atom.");
        let given = if operation.starts_with("st.") { 0 } else { words.len() - usize::from(is_atomic) };
        instruction.results = words[..given].iter().map(|word| self.register(word)).collect();
        for (operand, word) in instruction.operands.iter_mut().zip(&words[given..]) {
            check_stored(word, bytes);
            *operand = self.operand(word);
        }
        instruction.action = match (given, is_atomic) {
            (0, _) => Action::Store { count: words.len(), bytes },
            (_, true) => Action::AtomicAdd,
            (count, _) => Action::Load { count, bytes },
        };
    }

    fn call(&mut self, text: &str, instruction: &mut Instruction) {
        let (result, rest) = match text.strip_prefix('(') {
            Some(rest) => {
                let (name, rest) = rest.split_once("),").expect("a result");
                (Some(self.places[name.trim()]), rest.trim())
            }
            None => (None, text),
        };
        let (name, arguments) = rest.split_once(',').unwrap_or((rest, ""));
        let arguments = arguments.trim().trim_matches(['(', ')']);
        let arguments = arguments.split(',').map(str::trim).filter(|name| !name.is_empty());
        let parameters = arguments.map(|name| self.places[name]).collect();
        let at = self.module.code.len();
        self.calls.push((at, name.trim().to_owned(), Signature { start: at, parameters, result }));
        instruction.action = Action::Call { to: 0, arguments: vec![], result: None };
    }

    fn link_calls(&mut self) {
        for (at, name, given) in std::mem::take(&mut self.calls) {
            let function = &self.functions[&name];
            let pairs = given.parameters.iter().zip(&function.parameters);
            let arguments = pairs.map(|(from, to)| [from.0, to.0, to.1]).collect();
            let result = given.result.zip(function.result).map(|(to, from)| [from.0, to.0, to.1]);
            self.module.code[at].action = Action::Call { to: function.start, arguments, result };
        }
    }
}
