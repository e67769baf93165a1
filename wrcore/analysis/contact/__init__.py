"""Contact in single poses."""
