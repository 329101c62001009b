"""Touch an organ in real time: from a tensor bundle and tools to forces and the deformed shape.

Lengths are in metres, forces in newtons, times in seconds; points are rows x y z. Arrays of a bundle and of contacts are views, not
copies. A scene writes shapes into arrays of the caller.
"""

import difflib
import re

from palpate import _calls, _palpate
from palpate._calls import Place

# All that the module has; EFFECTS, the keywords of a scene, is for the messages below alone.
__all__ = [_name for _name in vars(_palpate) if not _name.startswith("_") and _name != "EFFECTS"] + ["__version__"]
globals().update({_name: getattr(_palpate, _name) for _name in __all__})
__all__.append("Place")
Place.__module__ = "palpate"
_calls.add_to(_palpate.Bundle, _palpate.Scene, _palpate.Tool)


def _with_plain_errors(kind, method):
    """Has a method of a class say which keyword it does not know, where pybind11 would print the whole signature."""
    held = kind.__dict__[method]
    is_static = isinstance(held, staticmethod)
    made = held.__func__ if is_static else held
    name = kind.__name__ if method == "__init__" else "%s.%s" % (kind.__name__, method)
    signatures = re.findall(r"%s\((.*)\) -> " % method, made.__doc__ or "")
    # The names in front of a type and a default, which have brackets, blanks and equals signs of their own.
    known = [word for signature in signatures
             for word in re.findall(r"(?:^|, )(\w+): ", re.sub(r"\[[^][]*\]|\([^()]*\)", "", signature)) if word != "self"]
    if any("**kwargs" in signature for signature in signatures):
        known += _palpate.EFFECTS

    def plain(*positional, **named):
        try:
            return made(*positional, **named)
        except TypeError as error:
            if not re.search(r"\b%s\(\)(: incompatible (constructor|function) arguments| got an unexpected keyword)" % method, str(error)):
                raise
            unknown = [word for word in named if word not in known]
            if unknown:
                near = difflib.get_close_matches(unknown[0], known, 1)
                said = "expected a keyword that it has, found %r%s; help(palpate.%s) lists them" % (
                    unknown[0], "; did you mean %r?" % near[0] if near else "", name)
            else:
                given = [type(value).__name__ for value in (positional if is_static else positional[1:])]
                given += ["%s: %s" % (word, type(value).__name__) for word, value in named.items()]
                said = "expected other arguments, found %s; help(palpate.%s) says which" % (", ".join(given) or "none", name)
            raise TypeError("%s: %s" % (name, said)) from None

    plain.__name__, plain.__qualname__, plain.__doc__ = method, "%s.%s" % (kind.__name__, method), made.__doc__
    setattr(kind, method, staticmethod(plain) if is_static else plain)


for _each in [_held for _held in vars(_palpate).values() if type(_held).__name__ == "pybind11_type"] + [Place]:
    _each.__module__ = "palpate"
    for _method in [_name for _name, _held in vars(_each).items() if not isinstance(_held, property) and callable(getattr(_each, _name))]:
        if _method == "__init__" or not _method.startswith("_"):
            _with_plain_errors(_each, _method)
