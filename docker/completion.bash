# Completion of docker/fenwear for bash and zsh, also under the alias `fenwear`:
#
#   source docker/completion.bash        in ~/.bashrc or ~/.zshrc, with the whole path
#
# shellcheck shell=bash

if [ -n "${ZSH_VERSION:-}" ]; then
    autoload -U +X compinit && compinit
    autoload -U +X bashcompinit && bashcompinit
    eval '_fenwear_launcher=${${(%):-%x}:A:h}/fenwear'
else
    _fenwear_launcher=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/fenwear
fi

_fenwear_words() {
    local line
    COMPREPLY=()
    while IFS= read -r line; do
        COMPREPLY+=("$line")
        case $line in *=) compopt -o nospace 2>/dev/null ;; esac
    done < <("$_fenwear_launcher" --complete "$COMP_CWORD" "${COMP_WORDS[@]}" 2>/dev/null)
}

complete -o default -F _fenwear_words fenwear
