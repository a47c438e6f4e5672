//! The scripts that make an overlay known to a shell.

/// In every script of ours: others are not written over.
pub const MARK: &str = "written by salient_stereo install-ament";

/// Names in the prefix, and texts.
pub const SCRIPTS: [(&str, &str); 3] = [
    (
        "setup.bash",
        "# written by salient_stereo install-ament\n\
         . \"$(cd \"$(dirname \"${BASH_SOURCE[0]}\")\" && pwd)/setup.sh\"\n",
    ),
    (
        "setup.zsh",
        "# written by salient_stereo install-ament\n\
         . \"$(cd \"$(dirname \"${(%):-%x}\")\" && pwd)/setup.sh\"\n",
    ),
    (
        "setup.sh",
        "# written by salient_stereo install-ament\n\
         # A plain sh cannot know where a sourced file is: it needs AMENT_CURRENT_PREFIX.\n\
         if [ -n \"${BASH_SOURCE:-}\" ]; then\n\
         \x20 _prefix=\"$(cd \"$(dirname \"$BASH_SOURCE\")\" && pwd)\"\n\
         elif [ -n \"${ZSH_VERSION:-}\" ]; then\n\
         \x20 _prefix=\"$(eval 'cd \"$(dirname \"${(%):-%x}\")\" && pwd')\"\n\
         else\n\
         \x20 _prefix=\"${AMENT_CURRENT_PREFIX:?set it to the folder of this file}\"\n\
         fi\n\
         case \":${AMENT_PREFIX_PATH:-}:\" in\n\
         \x20 *\":$_prefix:\"*) ;;\n\
         \x20 *) export AMENT_PREFIX_PATH=\"$_prefix${AMENT_PREFIX_PATH:+:$AMENT_PREFIX_PATH}\" ;;\n\
         esac\n\
         unset _prefix\n",
    ),
];
