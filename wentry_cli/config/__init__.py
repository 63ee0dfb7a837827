"""What the user wrote: YAML with places, validated into frozen models; campaigns, drops and materials."""
