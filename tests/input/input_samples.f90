!! A small schema, inputs of it, and what is read from them.
module input_samples
   use razy_core_error, only: error_t
   use razy_input_input, only: check_input, input_t
   use razy_core_kinds, only: wp
   use razy_input_reader, only: entries_t, read_entries
   use razy_input_schema, only: add_group, add_integer, add_logical, add_name, add_real, add_string, group_spec_t, nonnegative, &
                                positive
   use razy_core_text, only: append_text, string_t
   implicit none(type, external)
   private

   public :: lf, lines, marked, read_input, read_sample, sample_schema, scene, valid

   character(*), parameter :: lf = achar(10)
   !> A valid input, with a caret for each line end.
   character(*), parameter :: valid = "&scene kind='LUMPED', title='Pair' /^&inertia name='motor', value=0.1 /^"// &
                              "&inertia name='wheel', value=2*0.2 /^"
   character(*), parameter :: scene = "&scene kind='lumped' /^"

contains

   !> A small schema with every type of key.
   function sample_schema() result(schema)
      type(group_spec_t), allocatable :: schema(:)

      call add_group(schema, "scene", "What the input describes")
      call add_string(schema, "kind", "kind of scene", choices=[character(6) :: "lumped", "planar", "rotor"], required=.true.)
      call add_string(schema, "title", "heading of plots", default="")
      call add_group(schema, "inertia", "Rotating inertia", repeatable=.true.)
      call add_name(schema)
      call add_real(schema, "value", "moment of inertia", unit="kg m^2", rule=positive, least=1, most=2, required=.true.)
      call add_group(schema, "gear_mesh", "Mesh of two gears", repeatable=.true.)
      call add_name(schema, required=.false.)
      call add_string(schema, "between", "the two gears", count=2)
      call add_real(schema, "radius", "base radii", unit="m", rule=positive, count=2, default="0.08, 0.09")
      call add_integer(schema, "teeth", "numbers of teeth", low=5, high=500, count=2)
      call add_real(schema, "backlash", "backlash", unit="m", rule=nonnegative, default="0")
      call add_real(schema, "error_sine", "sine terms of the error", unit="m", most=64)
      call add_string(schema, "loss", "where contact ends", choices=[character(8) :: "force", "gap"], default="gap")
      call add_group(schema, "motion", "The motion")
      call add_real(schema, "t_end", "end", unit="s", rule=positive, default="1")
      call add_real(schema, "ratio", "a ratio", low=-1.0_wp, high=1.0_wp, default="0.5")
      call add_integer(schema, "periods", "periods", rule=positive)
      call add_logical(schema, "store", "whether to store", default=".true.")
      call add_logical(schema, "parts", "which parts", most=3)
   end function sample_schema

   !> The text with line feeds for the carets.
   pure function lines(text)
      character(*), intent(in) :: text
      character(len(text)) :: lines
      integer :: i

      do i = 1, len(text)
         lines(i:i) = text(i:i)
         if (text(i:i) == "^") lines(i:i) = lf
      end do
   end function lines

   !> The text with line feeds for carets and carets for @.
   pure function marked(text)
      character(*), intent(in) :: text
      character(len(text)) :: marked
      integer :: i

      marked = lines(text)
      do i = 1, len(text)
         if (marked(i:i) == "@") marked(i:i) = "^"
      end do
   end function marked

   !> Read a text and check it against a schema; `options` are values for `--set`.
   subroutine read_input(input, text, file, schema, options, error)
      type(input_t), intent(out) :: input
      character(*), intent(in) :: text, file
      type(group_spec_t), intent(in) :: schema(:)
      type(string_t), intent(in) :: options(:)
      type(error_t), allocatable, intent(out) :: error
      type(entries_t) :: said

      call read_entries(said, text, file, options, error)
      if (.not. allocated(error)) call check_input(input, said, schema, error)
   end subroutine read_input

   !> Read a text with carets for line ends; `options` are values for `--set` with a bar between them.
   subroutine read_sample(text, options, input, message)
      character(*), intent(in) :: text, options
      type(input_t), intent(out) :: input
      character(:), allocatable, intent(out) :: message
      type(error_t), allocatable :: error
      type(string_t), allocatable :: overrides(:)
      character(:), allocatable :: rest
      integer :: bar

      allocate (overrides(0))
      rest = options
      do while (len(rest) > 0)
         bar = index(rest//"|", "|")
         call append_text(overrides, rest(:bar - 1))
         rest = rest(min(bar, len(rest)) + 1:)
      end do
      call read_input(input, lines(text), "f", sample_schema(), overrides, error)
      message = ""
      if (allocated(error)) message = error%message
   end subroutine read_sample

end module input_samples
