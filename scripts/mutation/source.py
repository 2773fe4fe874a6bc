"""Reads C++, as far as mutations need it: statements, and what in them can be broken."""

import collections
import re

TOKEN = re.compile(r'''
    (?P<comment>//[^\n]*|/\*.*?\*/)
  | (?P<directive>(?m:^[ \t]*\#(?:[^\n\\]|\\.|\\\n)*))
  | (?P<string>(?:u8|[uUL])?R"(?P<delimiter>[^(\s]*)\(.*?\)(?P=delimiter)"|(?:u8|[uUL])?"(?:[^"\\\n]|\\.)*")
  | (?P<char>(?:u8|[uUL])?'(?:[^'\\\n]|\\.)+')
  | (?P<number>\.?\d(?:[eEpP][+-]|[\w.]|'\w)*)
  | (?P<name>[A-Za-z_]\w*)
  | (?P<op><=>|->\*|\.\.\.|<<=|>>=|::|->|\+\+|--|<<|<=|>=|==|!=|&&|\|\||\+=|-=|\*=|/=|%=|&=|\|=|\^=|[^\s\w])
  | (?P<space>\s+)
''', re.X | re.S)
Token = collections.namedtuple('Token', 'kind text start end')

SKIPPED_STARTS = {'static_assert', 'using', 'typedef', 'namespace', 'template', 'enum', 'class',
                  'struct', 'union', 'friend', 'extern', 'public', 'private', 'protected', 'goto',
                  'asm', 'requires', 'concept'}
COMPARISONS = {'<': '<=', '<=': '<', '>': '>=', '>=': '>'}
SWAPS = {'min': ('limit', 'max'), 'max': ('limit', 'min'), 'true': ('logic', 'false'),
         'false': ('logic', 'true'), 'sin': ('sign', 'cos'), 'cos': ('sign', 'sin'),
         'front': ('off by one', 'back'), 'back': ('off by one', 'front'),
         'floor': ('off by one', 'ceil'), 'ceil': ('off by one', 'floor'),
         'milliseconds': ('unit', 'microseconds'), 'seconds': ('unit', 'milliseconds'),
         'microseconds': ('unit', 'milliseconds'), 'any_of': ('logic', 'all_of'),
         'all_of': ('logic', 'any_of'), 'none_of': ('logic', 'any_of')}
ARITHMETIC = {'+': '-', '-': '+', '*': '/', '/': '*'}
ASSIGNMENTS = {'+=': '-=', '-=': '+=', '*=': '/=', '/=': '*='}


def tokens_of(text):
    """The tokens of a source, without comments, directives and blanks."""
    found = []
    for match in TOKEN.finditer(text):
        kind = match.lastgroup if match.lastgroup != 'delimiter' else 'string'
        if kind not in ('comment', 'directive', 'space'):
            found.append(Token(kind, match.group(), match.start(), match.end()))
    return found


def number_mutations(text):
    """(kind, other text) of a literal."""
    plain = text.replace("'", '')
    whole = re.fullmatch(r'(0[xX][0-9a-fA-F]+|0|[1-9]\d*)([uUlLzZ]*)', plain)
    if whole:
        value = int(whole.group(1), 0)
        spell = (lambda v: hex(v)) if whole.group(1)[:2] in ('0x', '0X') else str
        others = [value + 1] + ([value - 1] if value > 0 else [])
        return [('off by one', spell(v) + whole.group(2)) for v in others]
    real = re.fullmatch(r'((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)([fFlL]?)', plain)
    if not real:
        return []
    if float(real.group(1)) == 0.0:
        return [('limit', '1.0' + real.group(2))]
    return [('limit', f'(2.0 * {text})'), ('limit', f'(0.5 * {text})'), ('unit', f'(1e3 * {text})'),
            ('unit', f'(1e-3 * {text})')]


class Source:
    """One source: its statements, and the places that can be mutated."""

    def __init__(self, path, text):
        self.path, self.text, self.tokens = path, text, tokens_of(text)
        self.found = []
        self.scope = 'namespace'  # of the statement that is read
        self.match = {}
        open_at = []
        for i, token in enumerate(self.tokens):
            if token.text in ('(', '[', '{') and token.kind == 'op':
                open_at.append(i)
            elif token.text in (')', ']', '}') and token.kind == 'op' and open_at:
                self.match[open_at.pop()] = i
        self.block(0, len(self.tokens), 'namespace')

    def line(self, position):
        return self.text.count('\n', 0, position) + 1

    def is_block(self, i):
        """Whether the brace at i holds statements and not initial values."""
        end = self.match.get(i, i)
        before = self.tokens[i - 1] if i else None
        if any(t.text == ';' for t in self.tokens[i:end]):
            return True
        return before is not None and (
            before.text in (')', 'else', 'do', 'try', 'const', 'noexcept', 'override', 'TANDEM_RT'))

    def block(self, i, end, scope):
        """The statements from token i to end."""
        while i < end:
            i = self.statement(i, end, scope)

    def statement(self, begin, end, scope):
        tokens = self.tokens
        self.scope = scope
        first = tokens[begin].text
        if first in ('}', ';', ')'):
            return begin + 1
        if first in ('else', 'do', 'try') or (first in ('public', 'private', 'protected')):
            return begin + (2 if first[:2] in ('pu', 'pr') else 1)
        if first == '{':
            close = self.match.get(begin, end)
            self.block(begin + 1, close, scope)
            return close + 1
        if first in ('case', 'default') and scope == 'function':
            i = begin + 1
            while i < end and tokens[i].text != ':':
                i += 1
            return i + 1
        if first in ('if', 'while', 'for', 'switch'):
            i = begin + 1
            while i < end and tokens[i].text != '(':
                i += 1
            close = self.match.get(i, end)
            if i == begin + 1:
                self.condition(first, i + 1, close)
            return close + 1
        i, is_whole, assigned = begin, True, None
        while i < end and tokens[i].text != ';':
            text = tokens[i].text
            if text == '=' and assigned is None:
                assigned = i
            if text in ('(', '['):
                close = self.match.get(i, end)
                is_whole = self.inner_blocks(i, close) and is_whole
                i = close
            elif text == '{':
                close = self.match.get(i, end)
                if self.is_block(i) and tokens[begin].text != 'enum':
                    head = [t.text for t in tokens[begin:i]]
                    if assigned is not None:  # a lambda
                        self.block(i + 1, close, 'function')
                        is_whole = False
                    else:
                        self.literals(begin, i)  # default arguments, initial values of members
                        inner = 'function'
                        if '(' not in head or head[0] in ('class', 'struct', 'union'):
                            inner = 'class' if {'class', 'struct', 'union'} & set(head) else (
                                'namespace' if 'namespace' in head else 'function')
                        self.block(i + 1, close, inner)
                        return close + 1
                elif assigned is None and tokens[i - 1].text in ('namespace',):
                    self.block(i + 1, close, 'namespace')
                    return close + 1
                i = close
            i += 1
        self.scope = scope
        self.simple(begin, i, is_whole, assigned, scope)
        return i + 1

    def inner_blocks(self, i, close):
        """Statements of lambdas between two parentheses. True if there are none."""
        none = True
        j = i + 1
        while j < close:
            if self.tokens[j].text == '{' and self.is_block(j):
                self.block(j + 1, self.match.get(j, close), 'function')
                j = self.match.get(j, close)
                none = False
            j += 1
        return none

    def raw(self, i, end, changes=()):
        """The text of some tokens on one line."""
        parts, last = [], None
        changed = dict(changes)
        for j in range(i, end):
            token = self.tokens[j]
            if last is not None and token.start > last:
                parts.append(' ')
            parts.append(changed.get(j, token.text))
            last = token.end
        return ''.join(parts)

    def spaced(self, i):
        t = self.tokens[i]
        return (t.start > 0 and self.text[t.start - 1].isspace() and t.end < len(self.text)
                and self.text[t.end].isspace())

    def changes(self, i, end):
        """(kind, token, other text) of what is no literal."""
        for j in range(i, end):
            kind, text = self.tokens[j].kind, self.tokens[j].text
            before = self.tokens[j - 1].text if j else ''
            after = self.tokens[j + 1].text if j + 1 < end else ''
            if kind == 'op' and self.spaced(j):
                if text in COMPARISONS:
                    yield 'comparison', j, COMPARISONS[text]
                elif text in ('==', '!='):
                    yield 'equality', j, '!=' if text == '==' else '=='
                elif text in ('&&', '||') and after not in (')', ''):
                    yield 'logic', j, '||' if text == '&&' else '&&'
                elif text in ARITHMETIC and before not in ('', 'return', '(', ','):
                    if not ('string' in (self.tokens[j - 1].kind, self.tokens[j + 1].kind)):
                        yield 'sign' if text in '+-' else 'unit', j, ARITHMETIC[text]
                elif text in ASSIGNMENTS:
                    yield 'sign' if text in ('+=', '-=') else 'unit', j, ASSIGNMENTS[text]
            elif kind == 'op' and text == '!' and after not in ('', '='):
                yield 'logic', j, ''
            elif kind == 'op' and text == '-' and after and not self.text[self.tokens[j].end].isspace():
                if before in ('(', ',', '=', 'return', '?', ':', '{', '[', '<', '>', '*', '/', '+'):
                    yield 'sign', j, ''
            elif kind == 'name' and text in SWAPS:
                if text in ('true', 'false') or after == '(':
                    if not (text in ('front', 'back') and before not in ('.', '->')):
                        yield SWAPS[text][0], j, SWAPS[text][1]

    def add(self, kind, j, other, region, make):
        """Remembers one: `make(number)` gives the edits [(start, end, text)]."""
        lines = (self.line(region[0]), self.line(region[1] - 1))
        token = self.tokens[j]
        start = self.text.rfind('\n', 0, token.start) + 1
        stop = self.text.find('\n', token.end)
        line = self.text[start:stop]
        at = token.start - start
        mutated = line[:at] + other + line[at + len(token.text):]
        self.found.append({'file': self.path, 'line': self.line(token.start), 'lines': lines,
                           'kind': kind, 'scope': self.scope, 'original': line.strip(), 'mutated': mutated.strip(),
                           'make': make})

    def expression(self, i, end, wrap):
        """All that can be changed in an expression, which wrap(number, mutated, original) encloses."""
        if i >= end:
            return
        start, stop = self.tokens[i].start, self.tokens[end - 1].end
        original = self.text[start:stop]
        for kind, j, other in self.changes(i, end):
            mutated = self.raw(i, end, [(j, other)])
            self.add(kind, j, other, (start, stop),
                     lambda n, m=mutated: [(start, stop, wrap(n, m, original))])

    def literals(self, i, end, strip=None):
        """Every number among some tokens; strip: an edit without which it would not compile."""
        for j in range(i, end):
            token = self.tokens[j]
            if token.kind != 'number' or self.unset(j):
                continue
            for kind, other in number_mutations(token.text):
                region = (token.start if strip is None else strip[0], token.end)
                self.add(kind, j, other, region, lambda n, t=token, o=other: (
                    ([strip] if strip else [])
                    + [(t.start, t.end, f'(::mutation::is({n}) ? {o} : {t.text})')]))

    def unset(self, j):
        """Whether token j is a member's initial 0, -1 or false: mostly overwritten before it is read."""
        if self.scope != 'class':
            return False
        begin = j - 1 if self.tokens[j - 1].text == '-' else j
        return (self.tokens[begin - 1].text in ('=', '{') and self.tokens[j + 1].text in (';', '}', ',')
                and (self.tokens[j].text.rstrip('fFuUlL.0') == '' or self.tokens[j].text == 'false'
                     or begin < j and self.tokens[j].text == '1'))

    def condition(self, keyword, i, end):
        depth_zero, j = [], i
        self.inner_blocks(i - 1, end)
        while j < end:
            if self.tokens[j].text in ('(', '[', '{'):
                j = self.match.get(j, end)
            elif self.tokens[j].text == ';':
                depth_zero.append(j)
            elif self.tokens[j].text == ':' and keyword == 'for' and not depth_zero:
                return self.literals(j, end)  # for (x : range)
            j += 1
        self.literals(i, end)
        if keyword == 'switch' or any(t.text == '{' for t in self.tokens[i:end]):
            return None
        if keyword == 'for':
            if len(depth_zero) != 2:
                return None
            i, end = depth_zero[0] + 1, depth_zero[1]
        elif depth_zero:
            i = depth_zero[-1] + 1
        elif any(t.text == '=' for t in self.tokens[i:end]):
            return None
        return self.expression(i, end, lambda n, m, o: (
            f'(::mutation::is({n}) ? static_cast<bool>({m}) : static_cast<bool>({o}))'))

    def simple(self, begin, end, is_whole, assigned, scope):
        """A statement that ends with a semicolon."""
        tokens = self.tokens
        words = [t.text for t in tokens[begin:end]]
        if not words or words[0] in SKIPPED_STARTS or 'operator' in words[:6] or end >= len(tokens):
            return
        strip = None
        if 'constexpr' in words[:4]:
            if assigned is None and '(' in words:
                return
            at = begin + words.index('constexpr')
            both = words[:2] == ['static', 'constexpr'] and scope == 'class'
            strip = (tokens[at].start, tokens[at].end, 'inline const' if both else 'const')
        if is_whole:
            self.literals(begin, end, strip)
        start, stop = tokens[begin].start, tokens[end].end
        original = self.text[start:stop]
        if not is_whole or words[0] in ('break', 'continue'):
            return
        if words[0] == 'return':
            for kind, j, other in self.changes(begin, end) if scope == 'function' else ():
                mutated = self.raw(begin, end, [(j, other)])
                self.add(kind, j, other, (start, stop), lambda n, m=mutated: [(
                    start, stop, f'{{ if (::mutation::is({n})) {{ {m}; }} {original} }}')])
            return
        declares = assigned is not None and self.declares(begin, assigned)
        if declares:
            if tokens[assigned + 1].text == '{' or ',' in self.outer(assigned + 1, end):
                return
            for kind, j, other in list(self.changes(assigned + 1, end)):
                if self.unset(j + 1 if self.tokens[j].text == '-' else j):
                    continue
                s, e = tokens[assigned + 1].start, tokens[end - 1].end
                mutated, plain = self.raw(assigned + 1, end, [(j, other)]), self.text[s:e]
                self.add(kind, j, other, (strip[0] if strip else s, e),
                         lambda n, m=mutated, p=plain, s=s, e=e: (
                             ([strip] if strip else [])
                             + [(s, e, f'::mutation::is({n}) ? ({m}) : ({p})')]))
        elif scope == 'function':
            if assigned is None and len(words) > 1 and tokens[begin + 1].kind == 'name':
                return  # a declaration without a value, or with one in parentheses
            for kind, j, other in self.changes(begin, end):
                mutated = self.raw(begin, end, [(j, other)])
                self.add(kind, j, other, (start, stop), lambda n, m=mutated: [(
                    start, stop, f'{{ if (::mutation::is({n})) {{ {m}; }} else {{ {original} }} }}')])

    def outer(self, i, end):
        """The texts outside of parentheses."""
        found = []
        while i < end:
            found.append(self.tokens[i].text)
            i = self.match.get(i, i) + 1
        return found

    def declares(self, begin, assigned):
        """Whether `T x = …` and not `x = …`."""
        last, before = self.tokens[assigned - 1], self.tokens[assigned - 2] if assigned - begin > 1 else None
        if last.kind != 'name' or before is None:
            return False
        return before.kind == 'name' or before.text in ('>', '&', '*', '&&') and before is not self.tokens[begin]
