!! Frequencies of excitation of a lumped scene: those of loads and moving stops, and the tooth frequencies of its gear meshes.
!!
!! Bodies joined by springs, dampers or stops have the same mean speed; a mesh changes it in the ratio of the teeth. All
!! frequencies are formed in extended precision from the speed and whole numbers, and equal ones become one tone.
module razy_scenes_lumped_tones
   use razy_core_error, only: error_t
   use razy_core_input, only: input_t
   use razy_core_kinds, only: qp, wp
   use razy_core_tone, only: tone_from_hertz, tone_t
   use razy_scenes_lumped_bodies, only: bodies_t, find_body, find_ends
   implicit none(type, external)
   private

   public :: add_harmonic, find_speeds, harmonics_t, read_frequency

   !> The tones met so far, and the phasors on rows (forces or contact errors) that belong to each.
   type :: harmonics_t
      integer :: count = 0
      real(qp), allocatable :: hertz(:)
      type(tone_t), allocatable :: tone(:)
      !> Phasors (rows, tones): Re(phasor e^{iωt}).
      complex(wp), allocatable :: phasor(:, :)
      !> What harmonics of frequency zero add (rows).
      real(wp), allocatable :: constant(:)
   end type harmonics_t

contains

   !> Add cosine*cos(2πft) + sine*sin(2πft) to a row; a negative frequency turns the other way.
   pure subroutine add_harmonic(self, row, hertz, cosine, sine)
      type(harmonics_t), intent(inout) :: self
      integer, intent(in) :: row
      real(qp), intent(in) :: hertz
      real(wp), intent(in) :: cosine, sine

      complex(wp), allocatable :: larger(:, :)
      integer :: t, rows

      rows = size(self%constant)
      if (.not. (abs(cosine) > 0.0_wp .or. abs(sine) > 0.0_wp)) return
      if (.not. abs(hertz) > 0.0_qp) then
         self%constant(row) = self%constant(row) + cosine
         return
      end if
      do t = 1, self%count
         if (.not. abs(abs(hertz) - self%hertz(t)) > 4*epsilon(1.0_qp)*abs(hertz)) exit
      end do
      if (t > self%count) then
         self%count = t
         self%hertz = [self%hertz, abs(hertz)]
         self%tone = [self%tone, tone_from_hertz(abs(hertz))]
         allocate (larger(rows, t), source=(0.0_wp, 0.0_wp))
         larger(:, :t - 1) = self%phasor
         call move_alloc(larger, self%phasor)
      end if
      self%phasor(row, t) = self%phasor(row, t) + cmplx(cosine, -sign(1.0_wp, real(hertz, wp))*sine, wp)
   end subroutine add_harmonic

   !> The frequency of `group` number i, Hz, from the one of three keys (after `prefix`) that gives it.
   subroutine read_frequency(hertz, input, group, i, prefix, needed, error)
      real(qp), intent(out) :: hertz
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, prefix
      integer, intent(in) :: i
      logical, intent(in) :: needed
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: keys(3) = [character(17) :: "frequency", "angular_frequency", "order"]
      real(wp) :: value, speed
      logical :: given(3)
      integer :: k

      hertz = 0.0_qp
      do k = 1, 3
         given(k) = input%given(group, i, prefix//trim(keys(k)))
      end do
      if (needed .and. count(given) /= 1) then
         call input%complain(error, group, i, prefix//"amplitude", "one of "//prefix//"frequency, "//prefix// &
                             "angular_frequency and "//prefix//"order goes with an amplitude")
         return
      end if
      k = findloc(given, .true., dim=1)
      if (k == 0) return
      call input%get(group, i, prefix//trim(keys(k)), value)
      select case (k)
      case (1)
         hertz = value
      case (2)
         hertz = value/(2*acos(-1.0_qp))
      case (3)
         if (input%count("rotation") == 0) then
            call input%complain(error, group, i, prefix//"order", "an order needs &rotation")
            return
         end if
         call input%get("rotation", 1, "speed_rpm", speed)
         hertz = real(value, qp)*speed/60
      end select
   end subroutine read_frequency

   !> Mean speeds of all bodies, turns a second, in multiples of that of `&rotation`; 0 where nothing says what it is.
   subroutine find_speeds(input, bodies, ratio, error)
      type(input_t), intent(in) :: input
      type(bodies_t), intent(in) :: bodies
      real(qp), intent(out) :: ratio(:)
      type(error_t), allocatable, intent(out) :: error

      character(6), parameter :: joining(3) = ["spring", "damper", "stop  "]
      integer :: body, i, k, pass

      ratio = 0.0_qp
      if (input%count("rotation") == 0) return
      call find_body(bodies, input, "rotation", 1, "of", 1, body, error)
      if (allocated(error)) return
      if (.not. bodies%turns(body)) then
         call input%complain(error, "rotation", 1, "of", "the name of an inertia")
         return
      end if
      ratio(body) = 1.0_qp
      do pass = 1, bodies%count
         do k = 1, size(joining)
            do i = 1, input%count(trim(joining(k)))
               call join(trim(joining(k)), i, 1.0_qp)
               if (allocated(error)) return
            end do
         end do
         do i = 1, input%count("gear_mesh")
            call join("gear_mesh", i, tooth_ratio(input, i))
            if (allocated(error)) return
         end do
      end do

   contains

      !> The second body turns `change` times as fast as the first.
      subroutine join(group, index, change)
         character(*), intent(in) :: group
         integer, intent(in) :: index
         real(qp), intent(in) :: change

         integer :: ends(2)

         call find_ends(bodies, input, group, index, ends, error)
         if (allocated(error) .or. any(ends == 0)) return
         if (abs(ratio(ends(1))) > 0.0_qp .and. .not. abs(ratio(ends(2))) > 0.0_qp) then
            ratio(ends(2)) = change*ratio(ends(1))
         else if (abs(ratio(ends(2))) > 0.0_qp .and. .not. abs(ratio(ends(1))) > 0.0_qp) then
            ratio(ends(1)) = ratio(ends(2))/change
         else if (abs(ratio(ends(2)) - change*ratio(ends(1))) > 1.0e-20_qp*abs(ratio(ends(2)))) then
            call input%complain(error, group, index, "between", "bodies whose mean speeds agree with the rest of the machine")
         end if
      end subroutine join

   end subroutine find_speeds

   !> Speed of the second wheel of a mesh in multiples of that of the first.
   function tooth_ratio(input, mesh) result(ratio)
      type(input_t), intent(in) :: input
      integer, intent(in) :: mesh
      real(qp) :: ratio

      integer, allocatable :: teeth(:)

      call input%get("gear_mesh", mesh, "teeth", teeth)
      ratio = real(teeth(1), qp)/teeth(2)
   end function tooth_ratio

end module razy_scenes_lumped_tones
