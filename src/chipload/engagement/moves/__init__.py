"""The workpiece as its initial stock less the volumes that earlier moves swept: contact without a resolution."""
