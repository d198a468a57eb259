"""Compiled code that other kernels take in, and that never becomes machine code by itself.

numba optimises every function that a kernel calls and makes machine code of it, and does both once more in each
caller, which holds a copy. What only other kernels call is left out here but for its copies: nobody runs it. A run's
kernels compile in five sixths of the time, and are as fast.
"""

from typing import Any

from llvmlite import binding
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

_ENVIRONMENT = "_ZN08NumbaEnv"
"""How names of numba's environments begin: pointers to objects of Python that a function may use, set after loading."""


class LinkedCompiler(Compiler):  # type: ignore[misc]
    """numba's compiler, for functions that are only called by other compiled functions."""

    def compile_extra(self, func: Any) -> Any:
        """Compile a function of Python."""
        self.state.library = _LinkedLibrary(self.state.targetctx.codegen(), func.__qualname__)
        self.state.library.enable_object_caching()
        return super().compile_extra(func)


class _LinkedLibrary(JITCodeLibrary):  # type: ignore[misc]
    """A function's code for linking; the process gets its environments alone, which numba sets by their address."""

    _final_module: Any

    def _optimize_final_module(self) -> None:
        """Leave it to the callers, which optimise what they have taken in."""

    def _finalize_final_module(self) -> None:
        whole = self._final_module
        names = [variable.name for variable in whole.global_variables if variable.name.startswith(_ENVIRONMENT)]
        environments = "\n".join(f"@{name} = common global ptr null" for name in names)
        self._final_module = binding.parse_assembly(f'target triple = "{whole.triple}"\n{environments}')
        self._final_module.name = whole.name
        super()._finalize_final_module()
        self._final_module = whole
